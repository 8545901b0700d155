"""record: drive an episode of an environment and store it, with the ground truth, as an Episode."""

from __future__ import annotations

import math
from typing import Any, Protocol

import gymnasium as gym
import numpy as np

from dynslam_env.drawing.scene import pose_between
from dynslam_env.env import DoorWorldEnv
from dynslam_env.reset_options import reset_arguments
from dynslam_env.simulation.world import CONTROL_DT
from slam.episode import Episode, Truth
from slam.geometry import Array, Pose2
from slam.scan import Scan
from slam.trajectory import Trajectory
from slam.validation import instance


class Driver(Protocol):
    """An agent with the `predict` of stable-baselines3; a trained model is one."""

    def predict(
        self,
        observation: Any,
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = False,
    ) -> tuple[Any, Any]:
        """The action for an observation, and the next state of the driver."""
        ...


class Recorder:
    """Records an episode of `env`, from its current state on."""

    def __init__(self, env: DoorWorldEnv):
        self._env = env
        self._scans: list[Scan] = []
        self._odometry: list[Pose2] = [Pose2()]
        self._times: list[float] = [env.physics.time]
        self._states: list[tuple[Pose2, Array]] = []  # robot and doors, of every step
        self._taken: list[int] = []  # steps at which the scans were taken
        self._append()

    def step(self) -> None:
        """Record the last step of the environment; without a scan, only its odometry."""
        self._odometry.append(self._odometry[-1] @ self._env.displacement)
        self._times.append(self._env.physics.time)
        self._append()

    def _append(self) -> None:
        self._states.append((self._env.pose, self._env.outline()))
        if self._env.scan_arrived:
            self._scans.append(self._env.scan)
            self._taken.append(max(len(self._states) - 1 - self._env.scan_late, 0))

    def _true_pose(self, step: int) -> Pose2:
        """The pose at which the middle beam of the scan of a step was measured."""
        age, now = self._env.scanner.age / CONTROL_DT, self._states[step][0]
        if age == 0.0 or step == 0:
            return now
        return pose_between(self._states[step - 1][0], now, 1.0 - age)

    def episode(self, meta: dict[str, Any]) -> Episode:
        """The recording so far. Its odometry starts at the origin of the odometry frame; its truth
        is that at which the scans were taken, also of late ones; with a sweep, the middle beam.

        Faults that occurred are added to `meta`: `faults`, s by name.
        """
        poses = np.array([self._true_pose(step) for step in self._taken])
        doors = np.array([self._states[step][1] for step in self._taken])
        truth = Truth(poses, self._env.layout.walls, doors)
        odometry = Trajectory(np.array(self._times), np.array(self._odometry))
        faults = {k: at for k, at in self._env.fault_times.items() if not math.isnan(at)}
        meta = meta | {"faults": faults} if faults else meta
        return Episode(tuple(self._scans), odometry, truth, meta)


class RecordingWrapper(gym.Wrapper[Any, Any, Any, Any]):
    """Records each step of a world, where an outer environment repeats actions."""

    def __init__(self, env: DoorWorldEnv):
        """Record from the current state of `env` on."""
        super().__init__(env)
        self.recorder = Recorder(env)

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """Step, and record the step."""
        stepped = self.env.step(action)
        self.recorder.step()
        return stepped


def record(
    env: gym.Env[Any, Any], driver: Driver, seed: int | None = None, split: str | None = None
) -> Episode:
    """Drive one episode of `env` to its end, and record it.

    seed   of the episode; with a split, its index there
    split  "train", "validation" or "test"

    `env` may be wrapped; a time limit (as `gym.make` adds it) ends the recording. The same seed and
    driver give the same episode.
    """
    world = env.unwrapped
    instance("env.unwrapped", world, DoorWorldEnv)
    assert isinstance(world, DoorWorldEnv)
    observation, _ = env.reset(**reset_arguments(seed, split))
    recorder, state, start, ended = Recorder(world), None, np.ones(1, dtype=bool), False
    while not ended:
        action, state = driver.predict(observation, state, start, deterministic=True)
        observation, _, terminated, truncated, _ = env.step(action)
        recorder.step()
        start, ended = np.zeros(1, dtype=bool), terminated or truncated
    name = env.spec.id if env.spec is not None else type(world).__name__
    source = {"source": name, "seed": seed, "driver": type(driver).__name__}
    source |= {} if split is None else {"split": split}
    return recorder.episode(source | {"config": world.config})
