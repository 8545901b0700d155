"""What a child process is given to do: record a drive, or run a variant on an episode."""

from __future__ import annotations

import json
import re
import traceback
from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import cloudpickle
import numpy as np

import slam
from slam.benchmark.configuration import configuration
from slam.benchmark.results import Result, origin
from slam.benchmark.run import Run, build, run, warm_up
from slam.episode import Episode
from slam.errors import InputError

from ..console.process_memory import forget_peak, peak_mb, resident_mb
from .cache import episode_of
from .example import Example, example
from .scoring import Scorer, scorer
from .sources import Source, digest

EPISODES_AT_HAND = 2


class Job(Protocol):
    """Something that a child process can do."""

    @property
    def limit(self) -> float:
        """s, after which it counts as hanging."""
        ...

    def __call__(self) -> Done:
        """Do it; an exception of what is being tried is a result."""
        ...

    def row(self) -> Result:
        """What is known without doing it."""
        ...


class Done(NamedTuple):
    """What came of a job: a row of the results, and a run to be looked at."""

    row: Result
    example: Example | None = None


@dataclass(frozen=True)
class RecordEpisode:
    """Have the episode in the cache."""

    source: Source
    limit: float

    def __call__(self) -> Done:
        """Record it, if it is not there."""
        episode_of(self.source)
        return Done({})

    def row(self) -> Result:
        """Nothing."""
        return {}


@dataclass(frozen=True)
class Trial:
    """One variant on one episode.

    suite      that it is of
    condition  the factors that are compared, by name
    source     of the episode
    variant    its name
    builder    what makes it, cloudpickled, where it was registered by the user; else None
    limit      s, after which it counts as hanging
    pictured   whether to keep the run to be looked at
    """

    suite: str
    condition: Mapping[str, str | float]
    source: Source
    variant: str
    builder: bytes | None = None
    limit: float = 600.0
    pictured: bool = False

    def __call__(self) -> Done:
        """Run and score it; an exception, and figures that are not finite, are a result."""
        episode = None
        try:
            episode, scores_of = _at_hand(self.source)
            if self.builder is not None and self.variant not in slam.variants():
                slam.register(self.variant, cloudpickle.loads(self.builder))
            _warm(self.variant, episode)
            robot = build(self.variant, episode, self.source.seed)
            before = resident_mb()
            forget_peak()
            done = run(robot, episode)
            measured = {
                "scans": len(done.poses),
                "matched": done.matched,
                "seconds": done.seconds,
                "ms_per_matched_scan": done.ms_per_matched_scan,
                "peak_memory_mb": peak_mb(),
                "memory_mb": max(peak_mb() - before, 0.0),
                "slam": configuration(robot),
            }
            _check_finite(done)
            row = self.row(episode) | scores_of(done) | measured
            json.dumps(row, allow_nan=False)  # what cannot be written is no result
        except Exception as error:  # whatever a variant raises is its result
            return Done(self.row(episode) | failure(error))
        return Done(row, self._seen(episode) if self.pictured else None)

    def _seen(self, episode: Episode) -> Example | None:
        """The run to be looked at; its scores are there without it."""
        try:
            return example(self.variant, episode, self.source.seed)
        except Exception:
            return None

    def row(self, episode: Episode | None = None) -> Result:
        """What is known without running it."""
        row: Result = {
            "run": self.name,
            "suite": self.suite,
            "condition": list(self.condition),
            **self.condition,
            "variant": self.variant,
            "seed": self.source.seed,
            "episode": self.source.key,
            "error": None,
            "source": self.source.plain(),
            **origin(),
        }
        if episode is not None:
            row["duration"] = float(episode.times[-1] - episode.times[0])
        return row

    @property
    def name(self) -> str:
        """Of this variant on this episode under this condition, in every bench."""
        factors = digest(dict(self.condition))[:6]
        return f"{self.source.key}-{factors}-{file_name(self.variant)}"


def file_name(variant: str) -> str:
    """The name of a variant as part of a file's, on any system; two variants have two names."""
    plain = re.fullmatch(r"[\w.-]{1,60}", variant, re.ASCII)
    safe = re.sub(r"[^\w.-]", "-", variant, flags=re.ASCII)[:60]
    return variant if plain else f"{safe}-{digest({'variant': variant})[:6]}"


def failure(error: Exception | str) -> Result:
    """What a run that came to nothing has instead of scores."""
    if isinstance(error, str):
        return {"failed": True, "error": error}
    where = traceback.extract_tb(error.__traceback__)[-1]
    told = f"{type(error).__name__}: {error} ({where.filename.rsplit('/', 1)[-1]}:{where.lineno})"
    return {"failed": True, "error": told}


def _check_finite(done: Run) -> None:
    wrong = ~np.isfinite(done.poses).all(axis=1)
    if wrong.any():
        raise InputError(f"the pose at scan {int(np.argmax(wrong))} is not finite")
    if not np.isfinite(done.grid.occupied).all():
        raise InputError("the map is not finite")


_hand: OrderedDict[str, tuple[Episode, Scorer]] = OrderedDict()


def _at_hand(source: Source) -> tuple[Episode, Scorer]:
    """An episode and its scorer; the last few are kept, as all variants follow one another."""
    name = source.key
    if name not in _hand:
        episode = episode_of(source)
        _hand[name] = episode, scorer(source, episode)
        while len(_hand) > EPISODES_AT_HAND:
            _hand.popitem(last=False)
    return _hand[name]


_warmed: set[str] = set()


def _warm(variant: str, episode: Episode) -> None:
    """Compile what the variant needs, once a process."""
    if variant not in _warmed:
        warm_up(variant, episode)
        _warmed.add(variant)
