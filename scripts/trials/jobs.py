"""Jobs of a child process: record a drive, or run a variant on an episode."""

from __future__ import annotations

import gc
import json
import re
import time
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
from slam.interface import Slam
from slam.kernel import READYING

from ..console.process_memory import forget_peak, peak_mb, resident_mb
from .cache import episode_of
from .recorded_run import RecordedRun, record_slam
from .scoring import Scorer, scorer
from .sources import Source, digest

MAX_EPISODES_IN_MEMORY = 2


class Job(Protocol):
    """Work for a child process."""

    @property
    def limit(self) -> float:
        """Time limit, s; a longer job counts as hanging."""
        ...

    def __call__(self) -> Done:
        """Do the job; an exception of the tested code is a result."""
        ...

    def row(self) -> Result:
        """The part of the row that is known before the job is done."""
        ...


class Done(NamedTuple):
    """The outcome of a job: a row of the results, and a recorded run."""

    row: Result
    recorded: RecordedRun | None = None


@dataclass(frozen=True)
class RecordEpisode:
    """Record an episode into the cache."""

    source: Source
    limit: float

    def __call__(self) -> Done:
        """Record it, unless it is in the cache."""
        episode_of(self.source)
        return Done({})

    def row(self) -> Result:
        """Empty: a recording is no result."""
        return {}


@dataclass(frozen=True)
class Trial:
    """One variant on one episode.

    suite      name of the suite
    condition  the factors of the comparison, by name
    source     gives the episode
    variant    name of the SLAM variant
    builder    cloudpickled builder of a variant registered by the user; None for ours
    limit      time limit, s
    pictured   whether to record the run for pictures
    code       the code of the variant: see `code.Code`
    """

    suite: str
    condition: Mapping[str, str | float]
    source: Source
    variant: str
    builder: bytes | None = None
    limit: float = 600.0
    pictured: bool = False
    code: Mapping[str, str] | None = None

    def __call__(self) -> Done:
        """Run and score; an exception and non-finite numbers are results, too."""
        episode = None
        try:
            episode, scores_of = _load(self.source)
            done, measured = self.measured(episode)
            _check_finite(done)
            row = self.row(episode) | scores_of(done) | measured
            json.dumps(row, allow_nan=False)  # raises for numbers that JSON cannot hold
        except Exception as error:  # any exception of a variant is its result
            return Done(self.row(episode) | failure(error))
        return Done(row, self._recorded(done, episode) if self.pictured else None)

    def measured(self, episode: Episode) -> tuple[Run, Result]:
        """The run, and what it took: scans, times, memory, the configuration of the SLAM."""
        if self.builder is not None and self.variant not in slam.variants():
            slam.register(self.variant, cloudpickle.loads(self.builder))
        _warm(self.variant, episode)
        robot = build(self.variant, episode, self.source.seed)
        before = resident_mb()
        forget_peak()
        begun, readied = time.process_time(), READYING.seconds
        done = run(robot, episode)
        measured = {
            "scans": len(done.poses),
            "matched": done.matched,
            "seconds": done.seconds,
            "cpu_seconds": time.process_time() - begun - (READYING.seconds - readied),
            "ms_per_matched_scan": done.ms_per_matched_scan,
            "peak_memory_mb": peak_mb(),
            "memory_mb": max(peak_mb() - before, 0.0),
            "slam": configuration(robot),
        }
        return done, measured

    def again(self, done: Run, episode: Episode) -> Slam:
        """A SLAM that repeats the run `done`, for its pictures."""
        return build(self.variant, episode, self.source.seed)

    def _recorded(self, done: Run, episode: Episode) -> RecordedRun | None:
        """The recorded run; None if it fails: the scores do not need it."""
        try:
            return record_slam(self.again(done, episode), episode)
        except Exception:
            return None

    def row(self, episode: Episode | None = None) -> Result:
        """The part of the row that is known without running it."""
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
            "code": self.code,
            **origin(),
        }
        if episode is not None:
            row["duration"] = float(episode.times[-1] - episode.times[0])
            row["faults"] = dict(episode.meta.get("faults", {}))
        return row

    @property
    def name(self) -> str:
        """Unique name of the variant, episode and condition, the same in every bench."""
        factors = digest(dict(self.condition))[:6]
        return f"{self.source.key}-{factors}-{file_name(self.variant)}"


def file_name(variant: str) -> str:
    """A variant's name for use in file names on any system; unique per variant."""
    plain = re.fullmatch(r"[\w.-]{1,60}", variant, re.ASCII)
    safe = re.sub(r"[^\w.-]", "-", variant, flags=re.ASCII)[:60]
    return variant if plain else f"{safe}-{digest({'variant': variant})[:6]}"


def failure(error: Exception | str) -> Result:
    """The scores of a failed run."""
    if isinstance(error, str):
        return {"failed": True, "error": error}
    frame = traceback.extract_tb(error.__traceback__)[-1]
    where = f"{frame.filename.rsplit('/', 1)[-1]}:{frame.lineno}"
    message = f"{type(error).__name__}: {error} ({where})"
    return {"failed": True, "error": message}


def _check_finite(done: Run) -> None:
    wrong = ~np.isfinite(done.poses).all(axis=1)
    if wrong.any():
        raise InputError(f"the pose at scan {int(np.argmax(wrong))} is not finite")
    if not np.isfinite(done.grid.occupied).all():
        raise InputError("the map is not finite")


_loaded: OrderedDict[str, tuple[Episode, Scorer]] = OrderedDict()


def _load(source: Source) -> tuple[Episode, Scorer]:
    """An episode and its scorer; the last few stay in memory, as trials on one episode follow one
    another."""
    name = source.key
    if name not in _loaded:
        episode = episode_of(source)
        _loaded[name] = episode, scorer(source, episode)
        while len(_loaded) > MAX_EPISODES_IN_MEMORY:
            _loaded.popitem(last=False)
    return _loaded[name]


_warmed: set[str] = set()


def _warm(variant: str, episode: Episode) -> None:
    """Compile the kernels of the variant, once per process.

    What they and their modules hold stays, so the collector need not look at it before every run.
    """
    if variant not in _warmed:
        warm_up(variant, episode)
        _warmed.add(variant)
        gc.collect()
        gc.freeze()
