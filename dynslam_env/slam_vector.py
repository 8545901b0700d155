"""SlamVectorEnv: n worlds in one process, each with a SLAM."""

from __future__ import annotations

from typing import Any, Unpack

import gymnasium as gym
import numpy as np
from gymnasium import spaces
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from dynslam_env.env import Observation
from dynslam_env.reset_options import EpisodeOptions
from dynslam_env.simulation.world_batch import Rows, WorldBatch
from dynslam_env.simulation.world_view import WorldView
from dynslam_env.slam_run import SlamRun, SlamView, builder_of
from dynslam_env.vector import (
    Bools,
    DoorWorldVectorEnv,
    Infos,
    WorldVectorKeywords,
    columns_of,
    masked,
)
from slam.errors import InputError
from slam.geometry import Array, Pose2
from slam.interface import Builder, Estimate, Slam
from slam.validation import whole_number

WORLD_CLASS = "dynslam_env.env:DoorWorldEnv"


class SlamVectorEnv(DoorWorldVectorEnv):
    """n environments with a SLAM each: `SlamVectorEnv.make("DoorOffice-v0", 8, slam="hmm-ml")`.

    Observations, rewards, ends and infos are bit for bit those of a `SyncVectorEnv` of n
    `SlamWrapper(gym.make(ID), score_every=0)`; scores of the map are the wrapper's alone. Arguments
    are those of `SlamWrapper` without `score_every`, and those of `DoorWorldVectorEnv`. `call` and
    `get_attr` also know `slam` and `estimate`. It draws no maps.
    """

    def __init__(
        self,
        num_envs: int = 1,
        *,
        slam: str | Builder = "dynamic-ml",
        scan_every: int = 1,
        map_crop: float | None = None,
        map_cell: float = 0.05,
        pose_estimate: bool = False,
        seed: int = 0,
        render_mode: str | None = None,
        **keywords: Unpack[WorldVectorKeywords],
    ):
        super().__init__(num_envs, render_mode=render_mode, **keywords)
        whole_number("scan_every", scan_every, 1)
        self._build, self._scan_every = builder_of(slam, seed), scan_every
        self._build(Pose2())  # raises for an unknown name now, not at the first reset
        self._added = SlamView.of(map_crop, map_cell, pose_estimate)
        sensors = self.single_observation_space
        assert isinstance(sensors, spaces.Dict)
        self.single_observation_space = spaces.Dict({**sensors.spaces, **self._added.spaces()})
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self._runs: list[SlamRun | None] = [None] * num_envs
        self._views = {
            key: np.zeros((num_envs, *(space.shape or ())), space.dtype)
            for key, space in self._added.spaces().items()
        }

    @classmethod
    def make(cls, env_id: str, num_envs: int = 1, **keywords: Any) -> SlamVectorEnv:
        """The environments of an id of `WORLDS`, with its time limit and its keywords."""
        spec = gym.spec(env_id)
        if spec.entry_point != WORLD_CLASS:
            raise InputError(f"SlamVectorEnv needs an id of dynslam_env.WORLDS, got {env_id!r}")
        limit: dict[str, Any] = {"max_episode_steps": spec.max_episode_steps}
        return cls(num_envs, **{**limit, **spec.kwargs, **keywords})

    def _reset(self, i: int, asked: EpisodeOptions | None = None) -> None:
        super()._reset(i, asked)
        view = WorldView(self._batch, i)
        self._runs[i] = SlamRun(self._build(view.pose), view, self._scan_every)
        self._show(i)

    def _drive(self, which: Rows, commands: NDArray[Any]) -> Array:
        rewards = super()._drive(which, commands)
        ends, last = self._batch.progress.ends, self._steps + 1 >= self._config.limit
        for i in which.tolist():
            run = self._run(i)
            run.step()
            if last[i] or ends[i].any():
                run.finish()
            self._show(i)
        return rewards

    def _run(self, i: int) -> SlamRun:
        run = self._runs[i]
        assert run is not None  # there is one from the reset on
        return run

    def _show(self, i: int) -> None:
        """Write what the observation of world `i` has of its SLAM."""
        for key, value in self._added.observation(self._run(i)).items():
            self._views[key][i] = value

    def _observations(self) -> Observation:
        return super()._observations() | {key: rows.copy() for key, rows in self._views.items()}

    def _infos(self, mask: Bools) -> Infos:
        results = [None if run is None else run.result for run in self._runs]
        slams = masked(columns_of(results, mask), mask)
        return super()._infos(mask) | masked({"slam": slams}, mask)

    def _view(self, i: int) -> WorldView:
        return _SlamWorldView(self._batch, i, self._runs)


class _SlamWorldView(WorldView):
    """One of the worlds, with its SLAM."""

    def __init__(self, batch: WorldBatch, i: int, runs: list[SlamRun | None]):
        super().__init__(batch, i)
        self._runs = runs

    @property
    def slam(self) -> Slam:
        return self._begun_run.slam

    @property
    def estimate(self) -> Estimate:
        return self._begun_run.estimate

    @property
    def _begun_run(self) -> SlamRun:
        run = self._runs[self._row]
        if run is None:
            raise gym.error.ResetNeeded("there is no SLAM before reset()")
        return run
