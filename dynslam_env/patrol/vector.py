"""The native vector environment of patrols: many robots, each with a SLAM, in one process."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space

import slam as slam_library
from dynslam_env.patrol.config import NO_TASK, PatrolConfig
from dynslam_env.patrol.doors_known import DoorsKnown, brier
from dynslam_env.patrol.observation import observation_space
from dynslam_env.patrol.patroller import Patroller
from dynslam_env.patrol.rewards import RewardWeights
from dynslam_env.sensors.laser import Laser
from dynslam_env.sensors.odometry import Odometry
from dynslam_env.simulation.doors import Doors
from dynslam_env.simulation.fleet import Rows
from dynslam_env.simulation.laws import Law
from dynslam_env.simulation.people import People
from dynslam_env.simulation.robot import Robot
from dynslam_env.simulation.world import CONTROL_DT
from dynslam_env.vector import Bools, DoorWorldVectorEnv, Infos, masked
from dynslam_env.worlds.layout import Generator
from slam.geometry import Array, Pose2
from slam.interface import Estimate, Slam
from slam.scan import Scan

Observation = dict[str, Any]


class DoorPatrolVectorEnv(DoorWorldVectorEnv):
    """n patrols of one kind: `gym.make_vec("DoorPatrol-v0", n)`.

    Observations, rewards and ends are those of n `DoorPatrolEnv`, bit for bit, and so are
    `reward_terms`, `pose`, `door_angles`, `collision`, `time` and `door_brier` in the infos; the
    scores of the SLAM's map are the single environment's. Arguments are those of `DoorPatrolEnv`
    without `score_every`, and `num_envs`, `max_episode_steps`, `autoreset_mode` and `threads` of
    `DoorWorldVectorEnv`. It draws no pictures.
    """

    def __init__(
        self,
        num_envs: int = 1,
        *,
        max_episode_steps: int | None = None,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        threads: int = 1,
        slam: str = "hmm-ml",
        pay: RewardWeights | None = None,
        speed: float = 0.8,
        turn: float = 1.5,
        hold: int = 4,
        scan_every: int = 2,
        world: str | Generator | None = None,
        doors: str | Law | Doors = "moving",
        robot: Robot | None = None,
        laser: Laser | None = None,
        odometry: Odometry | None = None,
        people: People | None = None,
        render_mode: None = None,
    ):
        self.orders = PatrolConfig(slam, speed, turn, hold, scan_every, pay or RewardWeights())
        super().__init__(
            num_envs, max_episode_steps=max_episode_steps, autoreset_mode=autoreset_mode,
            threads=threads, world=world, doors=doors, robot=robot, laser=laser,
            odometry=odometry, people=people, task=NO_TASK, render_mode=render_mode,
        )  # fmt: skip
        self.single_action_space = spaces.Box(-1.0, 1.0, (2,), np.float32)
        self.single_observation_space = observation_space()
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        slam_library.make(slam)  # an unknown name is refused now, not at the first reset
        self._patrols: list[_Patrol] = [None] * num_envs  # type: ignore[list-item]
        self._touched = np.zeros(num_envs)
        self._terms = np.zeros((len(self.orders.pay.weights), num_envs))
        self._views = {
            key: np.zeros((num_envs, *space.shape), space.dtype)
            for key, space in self.single_observation_space.spaces.items()
            if space.shape is not None
        }

    def _reset(self, i: int, start: Pose2 | None = None) -> None:
        super()._reset(i, start)
        fleet = self._fleet
        system = slam_library.make(self.orders.slam, Pose2.of(fleet.drive.poses[i]), 0)
        self._patrols[i] = _Patrol(system, self._scan(i), DoorsKnown(fleet.layouts[i]))
        self._touched[i] = 0.0
        self._show(i)

    def _drive(self, which: Rows, commands: Array) -> Array:
        fleet, orders = self._fleet, self.orders
        commands = orders.commands(commands, self.setup.robot)
        patrols = [(i, self._patrols[i]) for i in which.tolist()]
        rewards = np.zeros(self.num_envs)
        for k in range(1, orders.hold + 1):
            fleet.step(which, commands)
            motions, collided = fleet.motions.tolist(), fleet.collided.tolist()
            for i, patrol in patrols:
                patrol.move(Pose2(*motions[i]), collided[i])
            if k % orders.scan_every == 0:
                estimates = [patrol.locate(self._scan(i)) for i, patrol in patrols]
                for (_, patrol), estimate in zip(patrols, estimates, strict=True):
                    patrol.robot.look(estimate, patrol.scan)
        for i, patrol in patrols:
            gains = patrol.robot.gains(fleet.worlds[i].time)
            terms = orders.pay.terms(gains)
            rewards[i], self._touched[i] = sum(terms.values()), gains.collision
            self._terms[:, i] = list(terms.values())
            self._show(i)
        return rewards

    def _scan(self, i: int) -> Scan:
        fleet = self._fleet
        return fleet.scanners[i].scan(fleet.ranges[i].copy(), fleet.worlds[i].time)

    def _show(self, i: int) -> None:
        """Write the observation of world `i`."""
        patrol = self._patrols[i]
        view = patrol.robot.observation(patrol.scan, self.orders.limits)
        for key, rows in self._views.items():
            rows[i] = view[key]

    def _briers(self) -> Array:
        """(n,) Brier score of the doors; zero where a world has not begun yet."""
        begun = [i for i, patrol in enumerate(self._patrols) if patrol is not None]
        near = np.array([self._patrols[i].near() for i in begun])
        briers = np.zeros(self.num_envs)
        briers[begun] = brier(near, self._openings.array()[begun])
        return briers

    def _observations(self) -> Observation:
        return {key: rows.copy() for key, rows in self._views.items()}

    def _infos(self, mask: Bools) -> Infos:
        infos = {
            "pose": self._fleet.drive.poses.copy(),
            "door_angles": self._openings.array(),
            "collision": self._touched.copy(),
            "time": self._steps * self.orders.hold * CONTROL_DT,
            "door_brier": self._briers(),
        }
        for rows in infos.values():
            rows[~mask] = 0
        return masked(infos, mask)

    def _judged(self, mask: Bools) -> Infos:
        if not mask.any():
            return {}
        names = self.orders.pay.weights
        terms = dict(zip(names, np.where(mask, self._terms, 0.0), strict=True))
        return masked({"reward_terms": masked(terms, mask)}, mask)


class _Patrol:
    """One robot, its SLAM, the last scan given to it, and the doors' score."""

    def __init__(self, system: Slam, scan: Scan, doors: DoorsKnown):
        self._doors, self._slam, self.scan = doors, system, scan
        self.robot = Patroller(system.update(Pose2(), scan), scan)
        self._moved = Pose2()

    def move(self, displacement: Pose2, collided: bool) -> None:
        """See `Patroller`."""
        self._moved = self._moved @ displacement
        self.robot.move(displacement, collided)

    def locate(self, scan: Scan) -> Estimate:
        """Update the SLAM by a scan and the displacement since the last one."""
        estimate = self._slam.update(self._moved, scan)
        self._moved, self.scan = Pose2(), scan
        return estimate

    def near(self) -> Array:
        """See `DoorsKnown`."""
        return self._doors.near(self.robot.memory, self.scan.time)
