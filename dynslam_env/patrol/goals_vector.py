"""The native vector environment of patrols with goals."""

from __future__ import annotations

from typing import Any, Unpack

import numpy as np
from gymnasium import spaces
from gymnasium.utils import seeding
from numpy.typing import NDArray

from dynslam_env.env import Observation
from dynslam_env.navigation.patrol_snapshot import PatrolSnapshot
from dynslam_env.patrol.config import PatrolConfig
from dynslam_env.patrol.goal_driver import Decision, GoalConfig, GoalDriver, goals_space, slots_of
from dynslam_env.patrol.goal_options import SLOTS, GoalOptions
from dynslam_env.patrol.snapshots import snapshot_of
from dynslam_env.patrol.vector import (
    DoorPatrolVectorEnv,
    Patrol,
    PatrolVectorKeywords,
    PatrolWorldView,
)
from dynslam_env.reset_options import EpisodeOptions
from dynslam_env.simulation.config import check_keywords
from dynslam_env.simulation.world_batch import Rows, WorldBatch
from dynslam_env.simulation.world_view import WorldView
from dynslam_env.vector import Bools, Infos, masked
from slam.errors import InputError
from slam.geometry import Array


class DoorPatrolGoalsVectorEnv(DoorPatrolVectorEnv):
    """n patrols with goals: `gym.make_vec("DoorPatrolGoals-v0", n)`.

    Observations, rewards, ends and infos are those of n `DoorPatrolGoalsEnv`, bit for bit; the
    scores of the SLAM's map are the single environment's. A step is a decision of each world: they
    go on at the same time, and those that take longer go on alone. Arguments are those of
    `DoorPatrolGoalsEnv` without `score_every`, and `num_envs`, `max_episode_steps` (decisions;
    none as registered), `autoreset_mode` and `threads` of `DoorWorldVectorEnv`. `call` and
    `get_attr` also know `options` and `action_masks`. It draws no pictures.
    """

    def __init__(
        self,
        num_envs: int = 1,
        *,
        patience: float = GoalConfig.patience,
        budget: float = GoalConfig.budget,
        render_mode: None = None,
        **keywords: Unpack[PatrolVectorKeywords],
    ):
        check_keywords(DoorPatrolGoalsVectorEnv, PatrolVectorKeywords, keywords)
        super().__init__(num_envs, render_mode=render_mode, **keywords)
        self._limits = GoalConfig(patience, budget).steps(self.patrol_config.period)
        rng = np.random.default_rng(0)  # not used: a reset makes a driver with its own
        self._drivers = [GoalDriver(self._limits, rng) for _ in range(num_envs)]
        self._pilot_rngs: list[np.random.Generator | None] = [None] * num_envs
        self._brier, self._reached = np.zeros(num_envs), np.zeros(num_envs, np.bool_)

    def _spaces(self) -> tuple[spaces.Space[Any], spaces.Dict]:
        return spaces.Discrete(SLOTS), goals_space()

    def _commands(self, actions: NDArray[Any], driven: Bools) -> NDArray[Any]:
        if np.shape(actions) != (self.num_envs,):
            raise InputError(
                f"actions must be {self.num_envs} whole numbers, got shape {np.shape(actions)}"
            )
        slots = np.zeros(self.num_envs, np.int64)
        slots[driven] = slots_of(list(np.asarray(actions)[driven]), self.single_action_space)
        return slots

    def _seed(self, i: int, seed: int | None) -> np.random.Generator:
        self._pilot_rngs[i] = seeding.np_random(seed)[0]  # a stream of the same seed, as alone
        return super()._seed(i, seed)

    def _reset(self, i: int, asked: EpisodeOptions | None = None) -> None:
        _, own = self._rng(i), self._pilot_rngs[i]
        assert own is not None
        self._drivers[i] = GoalDriver(self._limits, (asked or EpisodeOptions()).rng(own))
        super()._reset(i, asked)
        self._brier[i] = self._patrols[i].brier(self.physics[i].openings)

    def _drive(self, which: Rows, commands: NDArray[Any]) -> Array:
        decisions = {i: Decision.begun() for i in which.tolist()}
        for i in which.tolist():
            self._drivers[i].choose(int(commands[i]))
        actions, active = np.zeros((self.num_envs, 2), np.float32), which
        snapshots = {i: self._snapshot(i) for i in which.tolist()}
        while len(active):
            for i in active.tolist():
                actions[i] = self._drivers[i].action(snapshots[i])
            rewards = self._advance(active, actions)
            for i in active.tolist():
                terms = dict(zip(self._names, self._terms[:, i].tolist(), strict=True))
                brier = self._patrols[i].brier(self.physics[i].openings)
                decisions[i].add(float(rewards[i]), terms, brier, float(self._touched[i]))
                snapshots[i] = self._snapshot(i)
            active = np.array(
                [i for i in active.tolist() if self._drivers[i].goes_on(snapshots[i])], np.int64
            )
        total = np.zeros(self.num_envs)
        for i, decision in decisions.items():
            total[i], self._terms[:, i] = decision.reward, list(decision.reward_terms.values())
            self._brier[i], self._touched[i] = decision.means
            self._reached[i] = self._drivers[i].arrived(snapshots[i])
            self._show(i)
        return total

    def _snapshot(self, i: int) -> PatrolSnapshot:
        patrol = self._patrols[i]
        robot = self.world_config.robot
        return snapshot_of(patrol.robot, patrol.slam, patrol.scan, robot, self.patrol_config)

    def _view_of(self, i: int) -> Observation:
        return super()._view_of(i) | self._drivers[i].look(self._snapshot(i))

    def _truncated(self) -> Bools:
        return super()._truncated() | np.array([each.over for each in self._drivers])

    def _periods(self) -> NDArray[np.int64]:
        return np.array([each.driven for each in self._drivers])

    def _briers(self) -> Array:
        return self._brier.copy()

    def _view(self, i: int) -> WorldView:
        return _GoalsView(self._batch, i, self._patrols, self.patrol_config, self._drivers)

    def _step_infos(self, mask: Bools) -> Infos:
        if not mask.any():
            return {}
        steps = np.array([each.steps for each in self._drivers])
        told = {"steps": np.where(mask, steps, 0), "reached": self._reached & mask}
        return super()._step_infos(mask) | masked(told, mask)


class _GoalsView(PatrolWorldView):
    """One of the patrols, as `DoorPatrolGoalsEnv` shows it."""

    def __init__(
        self,
        batch: WorldBatch,
        i: int,
        patrols: list[Patrol],
        config: PatrolConfig,
        drivers: list[GoalDriver],
    ):
        super().__init__(batch, i, patrols, config)
        self._drivers = drivers

    @property
    def options(self) -> GoalOptions:
        _ = self._begun
        return self._drivers[self._row].options

    def action_masks(self) -> NDArray[np.bool_]:
        return self.options.mask
