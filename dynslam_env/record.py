"""record: an environment and a driver make an Episode, with the truth in it."""

from __future__ import annotations

from typing import Any, Protocol

import gymnasium as gym
import numpy as np

from dynslam_env.env import DoorWorldEnv
from slam.episode import Episode, Truth
from slam.geometry import Array, Pose2
from slam.scan import Scan
from slam.trajectory import Trajectory
from slam.validation import instance


class Driver(Protocol):
    """What drives: stable-baselines3's `predict`, so a trained model is one."""

    def predict(
        self,
        observation: Any,
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = False,
    ) -> tuple[Any, Any]:
        """The action for an observation, and the driver's own state."""
        ...


class Recorder:
    """Takes down one episode of `env`, from its reset on."""

    def __init__(self, env: DoorWorldEnv):
        self._env = env
        self._scans: list[Scan] = []
        self._odometry: list[Pose2] = [Pose2()]
        self._poses: list[Pose2] = []
        self._doors: list[Array] = []
        self._take()

    def step(self) -> None:
        """Take down what the last step of the environment brought."""
        self._odometry.append(self._odometry[-1] @ self._env.displacement)
        self._take()

    def _take(self) -> None:
        self._scans.append(self._env.scan)
        self._poses.append(self._env.pose)
        self._doors.append(self._env.outline())

    def episode(self, meta: dict[str, Any]) -> Episode:
        """The recording so far. The odometry begins at the origin of a frame of its own."""
        truth = Truth(np.array(self._poses), self._env.layout.walls, np.array(self._doors))
        times = np.array([scan.time for scan in self._scans])
        odometry = Trajectory(times, np.array(self._odometry))
        return Episode(tuple(self._scans), odometry, truth, meta)


class RecordingWrapper(gym.Wrapper[Any, Any, Any, Any]):
    """A world each of whose steps is taken down, for whoever drives it by several at a time."""

    def __init__(self, env: DoorWorldEnv):
        """From where `env` is now on."""
        super().__init__(env)
        self.recorder = Recorder(env)

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """Step, and take it down."""
        stepped = self.env.step(action)
        self.recorder.step()
        return stepped


def record(env: gym.Env[Any, Any], driver: Driver, seed: int | None = None) -> Episode:
    """Let `driver` drive one episode of `env`, to its end.

    `env` may be wrapped; a time limit in it (as `gym.make` puts there) bounds the recording.
    The same seed and driver, the same episode.
    """
    world = env.unwrapped
    instance("env.unwrapped", world, DoorWorldEnv)
    assert isinstance(world, DoorWorldEnv)
    observation, _ = env.reset(seed=seed)
    recorder, state, start, ended = Recorder(world), None, np.ones(1, dtype=bool), False
    while not ended:
        action, state = driver.predict(observation, state, start, deterministic=True)
        observation, _, terminated, truncated, _ = env.step(action)
        recorder.step()
        start, ended = np.zeros(1, dtype=bool), terminated or truncated
    source = {"source": "DoorCorridor-v0", "seed": seed, "driver": type(driver).__name__}
    return recorder.episode(source | {"config": world.config})
