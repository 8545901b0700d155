"""Checks of the `options` of a reset."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dynslam_env.splits import MAX_INDEX, SPLITS, SplitEpisode
from slam.errors import InputError
from slam.geometry import Pose2
from slam.validation import finite, instance, number, one_of, whole_number

Bools = NDArray[np.bool_]
DIFFICULTIES = ("easy", "medium", "hard")
OPTIONS = ("start", "split", "index", "difficulty")


class EpisodeOptions(NamedTuple):
    """What the options of a reset ask for; None: as the environment does without options.

    start       start pose
    place       episode of a split
    difficulty  one of DIFFICULTIES
    """

    start: Pose2 | None = None
    place: SplitEpisode | None = None
    difficulty: str | None = None

    def rng(self, own: np.random.Generator) -> np.random.Generator:
        """The generator of the episode: that of the split, else the environment's `own`."""
        return own if self.place is None else self.place.rng()

    @property
    def info(self) -> dict[str, Any]:
        """What the infos of the episode tell of the options: split and index, if given."""
        return {} if self.place is None else self.place.plain()


def episode_options(options: Mapping[str, Any] | None, seed: Any = None) -> EpisodeOptions:
    """The options of a single environment; raises InputError for invalid ones.

    seed  that of the reset, which must be None for an episode of a split
    """
    given = _copied(options)
    for name in given:
        one_of("an option of reset", name, OPTIONS)
    difficulty = given.get("difficulty")
    if difficulty is not None:
        one_of("options['difficulty']", difficulty, DIFFICULTIES)
    return EpisodeOptions(_start(given.get("start")), _place(given, seed), difficulty)


def reset_arguments(number: int | None, split: str | None) -> dict[str, Any]:
    """Arguments of `reset` for a seed, or, with a split, for the episode of that index."""
    if split is None:
        return {"seed": number}
    return {"options": {"split": split, "index": number}}


def options_of_each(
    options: Mapping[str, Any] | None, seeds: Sequence[int | None]
) -> tuple[Bools, list[EpisodeOptions]]:
    """The mask (n,) of the worlds to reset (default: all), and the options of each of n worlds.

    seeds  (n,) of the reset, one of each world

    An index holds for all worlds, as in Gymnasium's vector environments; a list has one for each.
    """
    n = len(seeds)
    mask, others = reset_mask(options, n)
    index = others.get("index")
    if not isinstance(index, Sequence | np.ndarray) or isinstance(index, str):
        return mask, [episode_options(others, seed) for seed in seeds]
    if len(index) != n:
        raise InputError(f"options['index'] must be one number or {n}, got {len(index)}")
    indices = [int(one) if isinstance(one, np.integer) else one for one in index]
    each = zip(indices, seeds, strict=True)
    return mask, [episode_options(others | {"index": one}, seed) for one, seed in each]


def reset_mask(options: Mapping[str, Any] | None, n: int) -> tuple[Bools, dict[str, Any]]:
    """The mask (n,) of the worlds to reset (default: all), and the other options."""
    others = _copied(options)
    mask = others.pop("reset_mask", np.ones(n, dtype=np.bool_))
    if not (isinstance(mask, np.ndarray) and mask.dtype == np.bool_ and mask.shape == (n,)):
        raise InputError(f"options['reset_mask'] must be a bool array of shape ({n},), got {mask}")
    if not mask.any():
        raise InputError("options['reset_mask'] must name at least one world, got none")
    return mask, others


def _start(start: Any) -> Pose2 | None:
    if start is None:
        return None
    finite("options['start']", start)
    if np.shape(start) != (3,):
        raise InputError(
            f"options['start'] must be three numbers x, y in m, theta in rad, got {start!r}"
        )
    return Pose2.of(start)


def _place(given: Mapping[str, Any], seed: Any) -> SplitEpisode | None:
    split, index = given.get("split"), given.get("index")
    if split is None and index is None:
        return None
    if split is None or index is None:
        raise InputError("options['split'] and options['index'] are given together, got one")
    one_of("options['split']", split, SPLITS)
    index = int(index) if isinstance(index, np.integer) else index
    whole_number("options['index']", index, 0)
    number("options['index']", index, 0, MAX_INDEX)
    if seed is not None:
        raise InputError(
            f"an episode of a split has no seed: split {split!r} and index {index} say all, "
            f"got the seed {seed!r} as well"
        )
    return SplitEpisode(split, index)


def _copied(options: Mapping[str, Any] | None) -> dict[str, Any]:
    """A copy of the options, empty for None."""
    given = {} if options is None else options
    instance("the options of reset", given, Mapping)
    return dict(given)
