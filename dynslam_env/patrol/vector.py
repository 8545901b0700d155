"""The native vector environment of patrols: many robots, each with a SLAM, in one process."""

from __future__ import annotations

from typing import Any, Unpack

import numpy as np
from gymnasium import spaces
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

import slam as slam_library
from dynslam_env.navigation.door_belief import DoorBelief
from dynslam_env.navigation.patrol_snapshot import PatrolSnapshot
from dynslam_env.patrol.config import NO_TASK, PatrolConfig, PatrolKeywords
from dynslam_env.patrol.doors_known import DoorsKnown
from dynslam_env.patrol.memory import DynamicMap
from dynslam_env.patrol.observation import observation_space
from dynslam_env.patrol.patroller import Patroller
from dynslam_env.patrol.snapshots import snapshot_of
from dynslam_env.reset_options import EpisodeOptions
from dynslam_env.simulation.config import check_keywords
from dynslam_env.simulation.world import CONTROL_DT
from dynslam_env.simulation.world_batch import Rows, WorldBatch
from dynslam_env.simulation.world_view import WorldView
from dynslam_env.slam_run import result_of
from dynslam_env.vector import Bools, DoorWorldVectorEnv, Infos, VectorKeywords, columns_of, masked
from slam.geometry import Array, Pose2
from slam.interface import Estimate, Slam
from slam.scan import Scan

Observation = dict[str, Any]


class PatrolVectorKeywords(PatrolKeywords, VectorKeywords, total=False):
    """Keywords of `DoorPatrolVectorEnv`."""


class DoorPatrolVectorEnv(DoorWorldVectorEnv):
    """n patrols of one kind: `gym.make_vec("DoorPatrol-v0", n)`.

    Observations, rewards and ends are those of n `DoorPatrolEnv`, bit for bit, and so are
    `reward_terms`, `pose`, `door_angles`, `collision`, `time`, `door_brier` and `slam` in the
    infos; the scores of the SLAM's map are the single environment's. `call` and `get_attr` know
    the names of `WorldView`, and `slam`, `patroller`, `limits`, `period`, `time`, `snapshot` and
    `door_beliefs` of `DoorPatrolEnv`.
    Arguments are those of `DoorPatrolEnv` without `score_every`, and `num_envs`,
    `max_episode_steps`, `autoreset_mode` and `threads` of `DoorWorldVectorEnv`. It draws no
    pictures.
    """

    def __init__(
        self,
        num_envs: int = 1,
        *,
        render_mode: None = None,
        **keywords: Unpack[PatrolVectorKeywords],
    ):
        check_keywords(DoorPatrolVectorEnv, PatrolVectorKeywords, keywords)
        self.patrol_config, others = PatrolConfig.split(keywords)
        super().__init__(num_envs, render_mode=render_mode, task=NO_TASK, **others)
        self.single_action_space, self.single_observation_space = self._spaces()
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        slam_library.make(self.patrol_config.slam)  # raises for an unknown name now, not at a reset
        self._patrols: list[Patrol] = [None] * num_envs  # type: ignore[list-item]
        self._touched = np.zeros(num_envs)
        self._names = tuple(self.patrol_config.reward.weights)
        self._terms = np.zeros((len(self._names), num_envs))
        self._views = {
            key: np.zeros((num_envs, *space.shape), space.dtype)
            for key, space in self.single_observation_space.spaces.items()
            if space.shape is not None
        }

    def _spaces(self) -> tuple[spaces.Space[Any], spaces.Dict]:
        """Of the actions and observations of one patrol."""
        return spaces.Box(-1.0, 1.0, (2,), np.float32), observation_space()

    def _reset(self, i: int, asked: EpisodeOptions | None = None) -> None:
        super()._reset(i, asked)
        batch = self._batch
        system = slam_library.make(self.patrol_config.slam, Pose2.of(batch.drive.poses[i]), 0)
        doors, truth = DoorsKnown(batch.layouts[i]), Pose2.of(batch.drive.poses[i])
        self._patrols[i] = Patrol(system, self._scan(i), doors, truth, self.patrol_config.memory())
        self._touched[i] = 0.0
        self._show(i)

    def _drive(self, which: Rows, commands: NDArray[Any]) -> Array:
        rewards = self._advance(which, commands)
        for i in which.tolist():
            self._show(i)
        return rewards

    def _advance(self, which: Rows, commands: NDArray[Any]) -> Array:
        """Hold actions (n, 2) in worlds `which`; (n,) rewards."""
        batch, patrol_config = self._batch, self.patrol_config
        commands = patrol_config.commands(commands, self.world_config.robot)
        patrols = [(i, self._patrols[i]) for i in which.tolist()]
        rewards, arrived = np.zeros(self.num_envs), dict[int, Scan]()
        for k in range(1, patrol_config.hold + 1):
            batch.step(which, commands)
            motions, collided = batch.displacements.tolist(), batch.collided.tolist()
            for i, patrol in patrols:
                patrol.move(Pose2(*motions[i]), collided[i])
            if not patrol_config.looked_at(k):
                continue
            arrived = {i: self._scan(i) for i, _ in patrols if batch.scan_arrived(i)}
            if patrol_config.matched(k):
                poses = batch.drive.poses.tolist()
                found = [self._patrols[i].locate(s, Pose2(*poses[i])) for i, s in arrived.items()]
                for (i, scan), estimate in zip(arrived.items(), found, strict=True):
                    self._patrols[i].robot.look(estimate, scan)
            else:
                for i, scan in arrived.items():
                    self._patrols[i].robot.skip(scan)
        for i, patrol in patrols:  # `arrived` is of the last control step
            patrol.scan = arrived[i] if i in arrived else self._scan(i)
            gains = patrol.robot.gains(batch.worlds[i].time)
            terms = patrol_config.reward.terms(gains)
            rewards[i], self._touched[i] = sum(terms.values()), gains.collision
            self._terms[:, i] = list(terms.values())
        return rewards

    def _scan(self, i: int) -> Scan:
        batch = self._batch
        return batch.scanners[i].scan(batch.ranges[i].copy(), batch.worlds[i].time)

    def _show(self, i: int) -> None:
        """Write the observation of world `i`."""
        for key, value in self._view_of(i).items():
            self._views[key][i] = value

    def _view_of(self, i: int) -> Observation:
        """The observation of world `i`."""
        patrol = self._patrols[i]
        return patrol.robot.observation(patrol.scan, self.patrol_config.limits)

    def _briers(self) -> Array:
        """(n,) Brier score of the doors; zero where a world has not begun yet."""
        briers = np.zeros(self.num_envs)
        for i, patrol in enumerate(self._patrols):
            if patrol is not None:
                briers[i] = patrol.brier(self.physics[i].openings)
        return briers

    def _observations(self) -> Observation:
        return {key: rows.copy() for key, rows in self._views.items()}

    def _infos(self, mask: Bools) -> Infos:
        infos = {
            "pose": self._batch.drive.poses.copy(),
            "door_angles": self._openings.array(),
            "collision": self._touched.copy(),
            "time": self._periods() * self.patrol_config.hold * CONTROL_DT,
            "door_brier": self._briers(),
        }
        for rows in infos.values():
            rows[~mask] = 0
        told = masked(infos, mask) | self._slam_infos(mask)
        return told | self._split_infos(mask) | self._fault_infos(mask)

    def _periods(self) -> NDArray[np.int64]:
        """(n,) for how many an action was held, since the reset."""
        return self._steps

    def _slam_infos(self, mask: Bools) -> Infos:
        """The results of the SLAMs of worlds `mask`; zero for the others."""
        results = [None if each is None else each.result for each in self._patrols]
        return masked({"slam": masked(columns_of(results, mask), mask)}, mask)

    def _view(self, i: int) -> WorldView:
        return PatrolWorldView(self._batch, i, self._patrols, self.patrol_config)

    def _step_infos(self, mask: Bools) -> Infos:
        if not mask.any():
            return {}
        terms = dict(zip(self._names, np.where(mask, self._terms, 0.0), strict=True))
        return masked({"reward_terms": masked(terms, mask)}, mask)


class PatrolWorldView(WorldView):
    """One of the patrols, as `DoorPatrolEnv` shows it."""

    def __init__(self, batch: WorldBatch, i: int, patrols: list[Patrol], config: PatrolConfig):
        super().__init__(batch, i)
        self._patrols, self._config = patrols, config
        self.limits, self.period = config.limits, config.period

    @property
    def slam(self) -> Slam:
        """The SLAM of this episode."""
        _ = self._begun
        return self._patrols[self._row].slam

    @property
    def patroller(self) -> Patroller:
        """The dynamic map and the SLAM's last estimate."""
        _ = self._begun
        return self._patrols[self._row].robot

    @property
    def time(self) -> float:
        """s since the episode began."""
        return self.patroller.time

    def snapshot(self) -> PatrolSnapshot:
        """What the robot knows now; its maps must be read before the next step."""
        return snapshot_of(self.patroller, self.slam, self.scan, self.robot, self._config)

    def door_beliefs(self) -> list[DoorBelief]:
        """What the robot believes now of each doorway that it suspects."""
        return self.patroller.memory.door_beliefs(self.time)


class Patrol:
    """One robot, its SLAM, the last scan given to it, and the doors' score."""

    def __init__(
        self, system: Slam, scan: Scan, doors: DoorsKnown, truth: Pose2, memory: DynamicMap
    ):
        self._doors, self.slam = doors, system
        self.scan = scan  # the last one, which may be without a reading
        self._moved = Pose2()
        self.robot = Patroller(self.locate(scan, truth), scan, memory)

    def move(self, displacement: Pose2, collided: bool) -> None:
        """See `Patroller`."""
        self._moved = self._moved @ displacement
        self.robot.move(displacement, collided)

    def locate(self, scan: Scan, truth: Pose2) -> Estimate:
        """Update the SLAM by a scan and the displacement since the last one.

        truth  pose of the robot, for the SLAM's errors in the info
        """
        estimate = self.slam.update(self._moved, scan)
        self._moved, self.result = Pose2(), result_of(estimate, truth)
        return estimate

    def brier(self, openings: Array) -> float:
        """See `DoorsKnown`."""
        return self._doors.brier(self.robot.memory, self.scan.time, openings)
