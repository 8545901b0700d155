"""DoorWorldVectorEnv: n worlds in one process as a Gymnasium VectorEnv."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TypedDict, Unpack

import gymnasium as gym
import numpy as np
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from dynslam_env.drawing.render import Viewer
from dynslam_env.drawing.scene import scene
from dynslam_env.env import DoorWorldEnv, Observation
from dynslam_env.faults.episode_faults import names_of
from dynslam_env.reset_options import EpisodeOptions, options_of_each
from dynslam_env.simulation.config import WorldConfig, WorldKeywords, check_keywords, split_keywords
from dynslam_env.simulation.pointers import addresses_of, copy_doubles
from dynslam_env.simulation.world import CONTROL_DT, World
from dynslam_env.simulation.world_batch import Rows, WorldBatch, actions_of
from dynslam_env.simulation.world_view import WorldView
from slam.errors import InputError
from slam.geometry import Array, Pose2
from slam.validation import one_of, whole_number

Bools = NDArray[np.bool_]
Infos = dict[str, Any]
Stepped = tuple[Observation, NDArray[np.float64], Bools, Bools, Infos]
NOWHERE = np.zeros(0, dtype=np.int64)
AUTORESET_MODES = tuple(mode.value for mode in AutoresetMode)


class VectorKeywords(TypedDict, total=False):
    """Keywords of every vector environment."""

    max_episode_steps: int | None
    autoreset_mode: str | AutoresetMode
    threads: int


class WorldVectorKeywords(WorldKeywords, VectorKeywords, total=False):
    """Keywords of `DoorWorldVectorEnv`."""


@dataclass(frozen=True)
class VectorConfig:
    """How the environments of a vector environment run.

    max_episode_steps  steps after which an episode is truncated; None or -1: never
    autoreset_mode     an `AutoresetMode` or its value
    threads            number of threads
    """

    max_episode_steps: int | None = None
    autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP
    threads: int = 1

    def __post_init__(self) -> None:
        if self.max_episode_steps not in (None, -1):  # -1 as in gymnasium.make
            whole_number("max_episode_steps", self.max_episode_steps, 1)
        if not isinstance(self.autoreset_mode, AutoresetMode):
            one_of("autoreset_mode", self.autoreset_mode, AUTORESET_MODES)
        whole_number("threads", self.threads, 1)

    @property
    def limit(self) -> float:
        """Steps after which an episode is truncated; inf for never."""
        return np.inf if self.max_episode_steps in (None, -1) else self.max_episode_steps


class DoorWorldVectorEnv(gym.vector.VectorEnv[Observation, NDArray[np.float32], NDArray[Any]]):
    """n environments with the same arguments in one process: `gym.make_vec(ID, n)`.

    Observations, rewards, ends and infos are bit for bit those of a `gymnasium.vector.SyncVectorEnv`
    of n single environments, at a fraction of the overhead. Spaces, rewards, infos and arguments are
    those of `DoorWorldEnv`; further arguments:

    | argument            | type, default         | content                                        |
    |---------------------|-----------------------|------------------------------------------------|
    | `num_envs`          | int, 1                | number of environments                         |
    | `max_episode_steps` | int, as registered    | steps after which an episode is truncated; None: never |
    | `autoreset_mode`    | `AutoresetMode` or its value, "NextStep" | NextStep: the step after the last one of an episode resets and ignores its action; SameStep: the last step resets, and the infos have `final_obs` and `final_info`; Disabled: the user resets by `options={"reset_mask": ...}` |
    | `threads`           | int, 1                | number of threads; the results do not depend on it |

    `reset(seed=s)` gives environment i the seed s + i; a list has a seed for each. Of a split,
    `reset(options={"split": "test", "index": [0, 1, 2]})` has an index for each; one number is that
    of all. Where worlds have unequal numbers of doors or people, the rows of `door_angles` and
    `people` in the infos are as long as the longest, and the shorter ones end in NaN.
    `get_attr(name)` and `call(name)` give what `WorldView` has of each world: `pose`, `layout`, ...
    """  # noqa: E501

    def __init__(
        self,
        num_envs: int = 1,
        *,
        render_mode: str | None = None,
        **keywords: Unpack[WorldVectorKeywords],
    ):
        check_keywords(DoorWorldVectorEnv, WorldVectorKeywords, keywords)
        whole_number("num_envs", num_envs, 1)
        config, parts = split_keywords(VectorConfig, keywords)
        one_of("render_mode", render_mode, (None, "rgb_array"))
        self.world_config = WorldConfig.of(parts)
        self.num_envs, self.render_mode, self._config = num_envs, render_mode, config
        self.autoreset_mode = AutoresetMode(config.autoreset_mode)
        own = {"autoreset_mode": self.autoreset_mode, "render_modes": ["rgb_array"]}
        self.metadata = DoorWorldEnv.metadata | own
        self.single_action_space = self.world_config.action_space()
        self.single_observation_space = self.world_config.observation_space()
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self._batch, self._all = (
            WorldBatch(self.world_config, num_envs, config.threads),
            np.arange(num_envs),
        )
        self._steps = np.zeros(num_envs, dtype=np.int64)
        self._over: Bools = np.ones(num_envs, dtype=np.bool_)
        self._openings, self._people = _RowStack(num_envs), _RowStack(num_envs)
        self._rngs: list[np.random.Generator | None] = [None] * num_envs
        self._seeds: list[int | None] = [None] * num_envs
        self._asked, self._in_split = [EpisodeOptions()] * num_envs, np.zeros(num_envs, np.bool_)
        self._faults = names_of(self.world_config.faults)
        self._viewers: list[Viewer] = []

    @property
    def np_random(self) -> tuple[np.random.Generator, ...]:  # type: ignore[override]
        """The random generators of the worlds."""
        return tuple(self._rng(i) for i in range(self.num_envs))

    @property
    def np_random_seed(self) -> tuple[int | None, ...]:  # type: ignore[override]
        """The seeds of the worlds."""
        _ = self.np_random
        return tuple(self._seeds)

    @property
    def physics(self) -> list[World]:
        """The simulated worlds of the current episodes."""
        return self._batch.worlds

    def get_attr(self, name: str) -> tuple[Any, ...]:
        """An attribute of each world: see `call`."""
        return self.call(name)

    def call(self, name: str, *args: Any, **kwargs: Any) -> tuple[Any, ...]:
        """What attribute `name` of `WorldView` is for each world; a method is called.

        Raises AttributeError for another name.
        """
        found = [getattr(self._view(i), name) for i in range(self.num_envs)]
        return tuple(one(*args, **kwargs) if callable(one) else one for one in found)

    def _view(self, i: int) -> WorldView:
        return WorldView(self._batch, i)

    # -- gymnasium -----------------------------------------------------------------------------

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Observation, Infos]:
        """Start new episodes, in all worlds or in those of `options["reset_mask"]` (n,) bool.

        options  also those of the single environment, for all worlds; "index" may be a list with
                 a number for each
        """
        seeds = self._seeds_of(seed)
        mask, asked = options_of_each(options, seeds)
        for i in np.flatnonzero(mask).tolist():
            if seeds[i] is not None:
                self._seed(i, seeds[i])
            self._reset(i, asked[i])
        return self._observations(), self._infos(mask)

    def step(self, actions: NDArray[np.float32]) -> Stepped:
        """Drive all robots for one control step of 0.1 s; actions (n, 2)."""
        commands = self._commands(actions, ~self._over)  # checked before any world is reset
        stepped = self._ready()
        which = self._all if stepped.all() else np.flatnonzero(stepped)
        rewards = np.where(stepped, self._drive(which, commands), 0.0)
        self._steps[which] += 1
        terminated = self._batch.progress.ends.any(axis=1) & stepped
        truncated = self._truncated() & stepped
        over, infos = terminated | truncated, {}
        if self.autoreset_mode is AutoresetMode.SAME_STEP and over.any():
            infos, stepped = self._finish(over), stepped & ~over
        else:
            self._over = over
        infos |= self._infos(np.ones(self.num_envs, dtype=np.bool_)) | self._step_infos(stepped)
        return self._observations(), rewards, terminated, truncated, infos

    def render(self) -> tuple[NDArray[np.uint8] | None, ...]:  # type: ignore[override]
        """An image (rows, columns, 3) of each world."""
        if self.render_mode is None:
            gym.logger.warn('render_mode is None: make_vec(..., render_mode="rgb_array") to see it')
            return (None,) * self.num_envs
        while len(self._viewers) < self.num_envs:
            self._viewers.append(Viewer(False, self.metadata["render_fps"]))
        poses = self._batch.drive.poses
        return tuple(
            viewer.draw(scene(self._batch, i, [Pose2.of(poses[i])]), None)
            for i, viewer in enumerate(self._viewers)
        )

    def close_extras(self, **kwargs: Any) -> None:
        """Stop the threads."""
        self._batch.close()

    def _commands(self, actions: NDArray[Any], driven: Bools) -> NDArray[Any]:
        """The actions of all worlds, checked for those that are `driven` (n,); raises InputError
        for wrong ones."""
        commands = actions_of(actions, (self.num_envs, 2))
        if not np.isfinite(commands[driven]).all():
            raise InputError("actions are finite numbers from -1 to 1, got some that are not")
        return commands

    def _truncated(self) -> Bools:
        """(n,) whether the time limit of an episode is reached."""
        return self._steps >= self._config.limit

    def _drive(self, which: Rows, commands: NDArray[Any]) -> Array:
        """Step worlds `which`; (n,) rewards."""
        self._batch.step(which, commands)
        return self._batch.progress.rewards

    # -- episodes ------------------------------------------------------------------------------

    def _reset(self, i: int, asked: EpisodeOptions | None = None) -> None:
        self._asked[i] = asked = asked or EpisodeOptions()
        self._in_split[i] = asked.place is not None
        try:
            rng, place = asked.rng(self._rng(i)), self.world_config.place(asked.difficulty)
            self._batch.reset(i, rng, asked.start, place)
            self._watch(i)
        except InputError:
            self._batch.discard(i)  # no step before a successful reset
            raise
        self._steps[i], self._over[i] = 0, False

    def _watch(self, i: int) -> None:
        """Take the rows of world `i`, which it changes in place."""
        self._openings.put(i, self.physics[i].openings)
        self._people.put(i, self.physics[i].people)

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Watch the worlds of the copy."""
        self.__dict__.update(state)
        for i, world in enumerate(self.physics):
            if world is not None:
                self._watch(i)

    def _rng(self, i: int) -> np.random.Generator:
        rng = self._rngs[i]
        return self._seed(i, None) if rng is None else rng

    def _seed(self, i: int, seed: int | None) -> np.random.Generator:
        rng, self._seeds[i] = seeding.np_random(seed)
        self._rngs[i] = rng
        return rng

    def _seeds_of(self, seed: int | Sequence[int | None] | None) -> list[int | None]:
        if seed is None:
            return [None] * self.num_envs
        if isinstance(seed, int | np.integer):
            return [int(seed) + i for i in range(self.num_envs)]
        if len(seed) != self.num_envs:
            raise InputError(f"seed must be one number or {self.num_envs}, got {len(seed)}")
        return list(seed)

    def _ready(self) -> Bools:
        """Mask (n,) of the worlds to step; those whose episode has ended are reset instead."""
        if not self._batch.ready:
            raise gym.error.ResetNeeded("call reset() before step()")
        stepped = ~self._over
        if not stepped.all():
            over = np.flatnonzero(self._over).tolist()
            if self.autoreset_mode is AutoresetMode.DISABLED:
                raise gym.error.ResetNeeded(
                    f"the episodes of worlds {over} are over and autoreset is disabled: "
                    'reset(options={"reset_mask": ...})'
                )
            for i in over:
                self._reset(i)
        return stepped

    def _finish(self, over: Bools) -> Infos:
        """Reset worlds `over`; the final observations and infos of their episodes."""
        observations = self._observations()
        last = np.full(self.num_envs, None, dtype=object)
        for i in np.flatnonzero(over).tolist():
            last[i] = {key: rows[i].copy() for key, rows in observations.items()}
        info = self._infos(over) | self._step_infos(over)
        for i in np.flatnonzero(over).tolist():
            self._reset(i)
        return masked({"final_obs": last, "final_info": info}, over)

    # -- observations and infos ----------------------------------------------------------------

    def _observations(self) -> Observation:
        batch = self._batch
        return {
            "scan": batch.scans.copy(),
            "odometry": batch.odometry.copy(),
            "velocity": batch.velocities.copy(),
        }

    def _infos(self, mask: Bools) -> Infos:
        """The infos of a reset and a step for worlds `mask`; zero for the others."""
        infos = {
            "pose": self._batch.drive.poses.copy(),
            "door_angles": self._openings.array(),
            "people": self._people.array(),
            "collision": self._batch.collided.copy(),
            "time": self._steps * CONTROL_DT,
        }
        if not mask.all():
            for rows in infos.values():
                rows[~mask] = 0
        told = masked(infos, mask) | self._contact_infos(mask)
        return told | self._split_infos(mask) | self._fault_infos(mask)

    def _split_infos(self, mask: Bools) -> Infos:
        """Split and index of those of worlds `mask` that have them; empty if none has."""
        has = self._in_split & mask
        if not has.any():
            return {}
        splits, indices = np.full(self.num_envs, None, dtype=object), np.zeros_like(self._all)
        for i in np.flatnonzero(has).tolist():
            splits[i], indices[i] = self._asked[i].info.values()
        return masked({"split": splits, "index": indices}, has)

    def _contact_infos(self, mask: Bools) -> Infos:
        """What the robots of worlds `mask` touched."""
        columns = self._batch.contact_columns()
        if not mask.all():
            for rows in columns.values():
                rows[~mask] = 0
        return masked({"contact": masked(columns, mask)}, mask)

    def _fault_infos(self, mask: Bools) -> Infos:
        """The infos of the faults of worlds `mask`; empty in environments without faults."""
        names = self._faults
        if not names:
            return {}
        active = np.zeros((len(names), self.num_envs), dtype=np.bool_)
        since = np.zeros((len(names), self.num_envs))
        for i in np.flatnonzero(mask).tolist():
            faults = self._batch.faults[i]
            assert faults is not None
            active[:, i], since[:, i] = faults.active(), faults.since()
        told = {"faults": active, "fault_times": since}
        named = {k: masked(dict(zip(names, v, strict=True)), mask) for k, v in told.items()}
        return masked(named, mask)

    def _step_infos(self, mask: Bools) -> Infos:
        """The further infos of a step for worlds `mask`: reward terms and ends."""
        if not mask.any():
            return {}
        judge, task = self._batch.progress, self.world_config.task
        terms = dict(zip(task.reward, np.where(mask, judge.terms.T, 0.0), strict=True))
        ends = dict(zip(task.ends, judge.ends.T & mask, strict=True))
        named = {"reward_terms": masked(terms, mask), "ends": masked(ends, mask)}
        return masked(named, mask)


def columns_of(rows: Sequence[dict[str, Any] | None], mask: Bools) -> Infos:
    """Arrays (n, ...) by name of the rows of worlds `mask`, of equal names; zero elsewhere."""
    columns: Infos = {}
    for i in np.flatnonzero(mask).tolist():
        for key, value in (rows[i] or {}).items():
            if key not in columns:
                one = np.asarray(value)
                columns[key] = np.zeros((len(rows), *one.shape), one.dtype)
            columns[key][i] = value
    return columns


def masked(infos: Infos, mask: Bools) -> Infos:
    """The infos with a mask `_key` for each key, as in Gymnasium: for which worlds it is valid."""
    masks = np.repeat(mask[None], len(infos), axis=0)
    return infos | {f"_{key}": row for key, row in zip(infos, masks, strict=True)}


class _RowStack:
    """Rows of n worlds, which the worlds change in place."""

    def __init__(self, n: int):
        self._rows: list[NDArray[np.float64] | None] = [None] * n
        self._sources: list[NDArray[np.int64]] = [NOWHERE] * n
        self._stack, self._between = np.empty((n, 0)), (NOWHERE, NOWHERE)
        self._arranged = False

    def __reduce__(self) -> tuple[type[_RowStack], tuple[int]]:
        """A copy's rows lie elsewhere: its owner puts them in."""
        return _RowStack, (len(self._rows),)

    def put(self, i: int, row: NDArray[np.float64]) -> None:
        """Set the row of world `i`."""
        self._rows[i], self._sources[i], self._arranged = row, addresses_of(row), False

    def array(self) -> NDArray[np.float64]:
        """(n, k, ...) current values; zero for a world without an episode. Shorter rows end in
        NaN."""
        if not self._arranged:
            self._arrange()
        copy_doubles(*self._between)
        return self._stack.copy()

    def _arrange(self) -> None:
        known = [row for row in self._rows if row is not None]
        shape = len(self._rows), max(map(len, known)), *known[0].shape[1:]
        self._stack, targets = np.zeros(shape), []
        for i, row in enumerate(self._rows):
            if row is not None:
                self._stack[i, len(row) :] = np.nan
                targets.append(np.arange(row.size) + i * math.prod(shape[1:]))
        first = self._stack.__array_interface__["data"][0]
        there = first + self._stack.itemsize * np.concatenate(targets)
        self._between, self._arranged = (np.concatenate(self._sources), there), True
