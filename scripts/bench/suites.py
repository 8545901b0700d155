"""Suites: which episodes, under which conditions, and which variants are run on each."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import cloudpickle

import slam
from dynslam_env import WORLDS, Corridor, Doors, Laser, Odometry, Uniform
from slam.algorithms.ceilings import CEILINGS
from slam.algorithms.variants import BUILDERS
from slam.errors import InputError
from slam.io.formats import has_registered_reader
from slam.registry import builder_of

from ..trials.jobs import Trial
from ..trials.scoring import ENDINGS, stem
from ..trials.sources import LogFile, SimulatedDrive, Source

Factors = Mapping[str, str | float]


@dataclass(frozen=True)
class SuiteCase:
    """One condition, and the episode of a seed under it."""

    condition: Factors
    source: Callable[[int], Source]


@dataclass(frozen=True)
class Suite:
    """An experiment.

    name      of it
    cases     its conditions, each with the episodes of the same seeds
    variants  that take part if none are named; the first is what the others are compared with
    seeds     how many, if that is not said
    """

    name: str
    cases: Sequence[SuiteCase]
    variants: Sequence[str]
    seeds: int

    def trials(self, variants: Sequence[str], seeds: range, limit: float) -> list[Trial]:
        """Every variant on every episode, those of one episode after one another; the first seed of
        each case is kept to be looked at."""
        builders = {name: shipped(name) for name in variants}
        return [
            Trial(
                self.name, case.condition, source, name, builders[name], limit, seed == seeds.start
            )
            for seed in seeds
            for case in self.cases
            for source in (case.source(seed),)
            for name in variants
        ]


def shipped(name: str) -> bytes | None:
    """A variant's builder, for processes that do not know it; None of our own, which all know.

    Raises InputError for an unknown name, and for a builder that cannot be sent.
    """
    if name in CEILINGS or name in BUILDERS:
        return None
    try:
        return cloudpickle.dumps(builder_of(name))
    except Exception as error:
        raise InputError(f"variant {name!r} cannot be sent to another process: {error}") from None


MATCHERS = ("static-ml", "clamped-ml", "recency-ml", "dynamic-ml", "hmm-ml")
SWEPT = ("static-ml", "dynamic-ml", "hmm-ml", "dynamic-graph")


def drive(env: str, seed: int, every: int = 1, **parameters: Any) -> Source:
    """A `SimulatedDrive`, its parameters as keywords."""
    return SimulatedDrive(env, seed, parameters, every)


def paper() -> Suite:
    """The paper's experiment: one passage, doors that stand or move."""
    corridor = partial(drive, "DoorCorridor-v0")
    cases = [SuiteCase({"doors": d}, partial(corridor, doors=d)) for d in ("static", "moving")]
    variants = (*MATCHERS, "dynamic-graph", "dynamic-pf", "odometry")
    return Suite("paper", cases, variants, seeds=30)


def worlds() -> Suite:
    """All environments, each along its path."""
    cases = [SuiteCase({"world": env}, partial(drive, env)) for env in WORLDS]
    return Suite("worlds", cases, (*MATCHERS, "dynamic-graph", "odometry"), seeds=10)


FLIPS = (1.5, 4.8, 12.0, 24.0)  # of a door, a minute
DOORS_PER_SIDE = (2, 4, 6, 8)
ODOMETRY_ERROR = (1.0, 2.0, 3.0, 4.0)  # times the default's
INTERVAL = (1, 5, 10, 20)  # scans
LASER_RANGE = (1.5, 2.5, 4.0, 8.0)  # m
SCAN_TIME = 0.1  # s


def change() -> Suite:
    """Planes of two factors each, all else as in the paper: where does which variant break?"""
    corridor = partial(drive, "DoorCorridor-v0")
    wall = Corridor()
    cases = []
    for flips in FLIPS:
        for n in DOORS_PER_SIDE:
            share = round(100 * n * wall.door_width / wall.length)
            condition = {"plane": "doors", "flips a minute": flips, "doors, % of the wall": share}
            make = partial(corridor, doors=flipping(flips), world=Corridor(doors_per_side=n))
            cases.append(SuiteCase(condition, make))
    for error in ODOMETRY_ERROR:
        for every in INTERVAL:
            condition = {"plane": "odometry", "odometry error, times": error,
                         "scan interval, s": SCAN_TIME * every}  # fmt: skip
            make = partial(corridor, every=every, odometry=worse(error))
            cases.append(SuiteCase(condition, make))
    for reach in LASER_RANGE:
        for flips in FLIPS:
            condition = {"plane": "laser", "laser range, m": reach, "flips a minute": flips}
            make = partial(corridor, doors=flipping(flips), laser=Laser(max_range=reach))
            cases.append(SuiteCase(condition, make))
    return Suite("change", cases, SWEPT, seeds=10)


def flipping(per_minute: float) -> Doors:
    """Doors that flip so often on average, the times spread as in the paper."""
    mean, paper = 60.0 / per_minute, Uniform()
    scale = mean / (0.5 * (paper.shortest + paper.longest))
    return Doors(law=Uniform(scale * paper.shortest, scale * paper.longest))


def worse(times: float) -> Odometry:
    """An odometry whose systematic error and standard deviations are so many times the default."""
    usual = Odometry()
    noise = {f"alpha{k}": times**2 * getattr(usual, f"alpha{k}") for k in (1, 2, 3, 4)}
    return replace(usual, bias=times * usual.bias, **noise)


def logs(folder: Path) -> Suite:
    """All logs of a folder: CARMEN (.log, .clf, also .gz), saved episodes (.npz) and files of
    registered formats, scored with what lies beside them: NAME.relations, NAME.tum, or the truth in
    the episode. Of one NAME, the .npz is taken."""
    if not folder.is_dir():
        raise InputError(f"{folder}: a folder of logs was expected")
    files: dict[str, Path] = {}
    for path in sorted(folder.iterdir()):
        if not path.is_file():
            continue
        known = path.name.endswith(ENDINGS) or has_registered_reader(path)
        if known and (path.suffix == ".npz" or stem(path.name) not in files):
            files[stem(path.name)] = path.resolve()
    if not files:
        raise InputError(f"{folder}: no log in it; its name ends with {', '.join(ENDINGS)}")
    cases = [
        SuiteCase({"log": name}, partial(LogFile, path)) for name, path in sorted(files.items())
    ]
    return Suite("logs", cases, ("static-ml", "dynamic-ml", "dynamic-graph", "odometry"), seeds=1)


SUITES: dict[str, Callable[[], Suite]] = {"paper": paper, "change": change, "worlds": worlds}


def known_variants() -> list[str]:
    """All names that a bench takes: the variants, and the ceilings that are shown the truth."""
    return [*slam.variants(), *CEILINGS]
