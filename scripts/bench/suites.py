"""Suites: conditions, their episodes, and the variants that run on each."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import cloudpickle

import slam
from dynslam_env import (
    WORLDS,
    CarriedAway,
    Corridor,
    Doors,
    EchoLoss,
    Effect,
    Fault,
    Gap,
    Lag,
    Laser,
    Latency,
    Loop,
    MissingBeams,
    MixedPixels,
    Odometry,
    OdometryScale,
    Office,
    Quantisation,
    RangeNoise,
    Slip,
    Surfaces,
    Sweep,
    Uniform,
    WrongBeams,
)
from slam.algorithms.ceilings import CEILINGS
from slam.algorithms.variants import BUILDERS
from slam.errors import InputError
from slam.io.formats import has_registered_reader
from slam.registry import builder_of

from ..console.selection import ALL, LIST_VARIANTS, parse_selection
from ..outside.adapter import PREFIX, find_adapter, known_outside
from ..trials.code import code_of, code_of_adapter
from ..trials.jobs import Trial
from ..trials.outside_trial import SCORING_TIME, OutsideTrial, told_version
from ..trials.scoring import LOG_ENDINGS, stem
from ..trials.sources import LogFile, SimulatedDrive, Source

Factors = Mapping[str, str | float]


@dataclass(frozen=True)
class SuiteCase:
    """A condition, and the source of its episode of a seed."""

    condition: Factors
    source: Callable[[int], Source]


@dataclass(frozen=True)
class Suite:
    """An experiment.

    name      of the suite
    cases     its conditions, all with the same seeds
    variants  default variants; the others are compared with the first
    seeds     default number of seeds
    """

    name: str
    cases: Sequence[SuiteCase]
    variants: Sequence[str]
    seeds: int

    def at(self, split: str | None, difficulty: str | None) -> Suite:
        """The suite with episodes of this split, and worlds of this difficulty; None: its own.

        Raises InputError for a suite of recordings.
        """
        named = {"split": split, "difficulty": difficulty}
        given = {name: value for name, value in named.items() if value is not None}
        if not given:
            return self
        cases = [
            SuiteCase(
                {**case.condition, **given}, partial(_drive_at, case.source, split, difficulty)
            )
            for case in self.cases
        ]
        return replace(self, cases=cases)

    def trials(self, variants: Sequence[str], seeds: range, limit: float) -> list[Trial]:
        """Every variant on every episode, grouped by episode.

        The runs on the first seed of each case are recorded for pictures.
        """
        makers = {name: maker(name, limit) for name in variants}
        return [
            makers[name](self.name, case.condition, source, name, pictured=seed == seeds.start)
            for seed in seeds
            for case in self.cases
            for source in (case.source(seed),)
            for name in variants
        ]


def _drive_at(
    source: Callable[[int], Source], split: str | None, difficulty: str | None, seed: int
) -> Source:
    """The drive of `source` in another split, or at a difficulty."""
    drive = source(seed)
    if not isinstance(drive, SimulatedDrive):
        raise InputError(
            "a recording has no split and no difficulty: leave out --split, --difficulty"
        )
    parameters = {**drive.parameters, **({"difficulty": difficulty} if difficulty else {})}
    return replace(drive, split=split or drive.split, parameters=parameters)


def maker(name: str, limit: float) -> Callable[..., Trial]:
    """Makes the trials of a variant, ours or an outside one. Raises InputError as `shipped`, and
    for an adapter that cannot be used."""
    if not name.startswith(PREFIX):
        builder = shipped(name)
        return partial(Trial, builder=builder, limit=limit, code=code_of(name)._asdict())
    adapter, whole = find_adapter(name), limit + SCORING_TIME
    code = code_of_adapter(adapter, told_version(adapter))._asdict()
    return partial(OutsideTrial, limit=whole, program_limit=limit, adapter=adapter, code=code)


def shipped(name: str) -> bytes | None:
    """The cloudpickled builder of a user's variant, for other processes; None for our own.

    Raises InputError for an unknown name, and for a builder that cannot be pickled.
    """
    if name in CEILINGS or name in BUILDERS:
        return None
    try:
        return cloudpickle.dumps(builder_of(name))
    except Exception as error:
        raise InputError(f"variant {name!r} cannot be sent to another process: {error}") from None


MATCHING_VARIANTS = ("static-ml", "clamped-ml", "recency-ml", "dynamic-ml", "hmm-ml")
CHANGE_VARIANTS = ("static-ml", "dynamic-ml", "hmm-ml", "dynamic-graph")


def drive(env: str, seed: int, every: int = 1, **parameters: Any) -> Source:
    """A `SimulatedDrive` with the environment's parameters as keywords."""
    return SimulatedDrive(env, seed, parameters, every)


def paper() -> Suite:
    """The paper's experiment: one corridor, static or moving doors."""
    corridor = partial(drive, "DoorCorridor-v0")
    cases = [SuiteCase({"doors": d}, partial(corridor, doors=d)) for d in ("static", "moving")]
    variants = (*MATCHING_VARIANTS, "dynamic-graph", "dynamic-pf", "odometry")
    return Suite("paper", cases, variants, seeds=30)


def worlds() -> Suite:
    """All environments, each along its own path."""
    cases = [SuiteCase({"world": env}, partial(drive, env)) for env in WORLDS]
    return Suite("worlds", cases, (*MATCHING_VARIANTS, "dynamic-graph", "odometry"), seeds=10)


FLIPS_PER_MINUTE = (1.5, 4.8, 12.0, 24.0)  # of a door
DOORS_PER_SIDE = (2, 4, 6, 8)
ODOMETRY_FACTORS = (1.0, 2.0, 3.0, 4.0)  # times the default error
SCAN_INTERVALS = (1, 5, 10, 20)  # scans
LASER_RANGES = (1.5, 2.5, 4.0, 8.0)  # m
SCAN_TIME = 0.1  # s


def change() -> Suite:
    """Planes of two factors each, all else as in the paper: how much change each variant stands."""
    corridor = partial(drive, "DoorCorridor-v0")
    wall = Corridor()
    cases = []
    for flips in FLIPS_PER_MINUTE:
        for n in DOORS_PER_SIDE:
            share = round(100 * n * wall.door_width / wall.length)
            condition = {"plane": "doors", "flips a minute": flips, "doors, % of the wall": share}
            make = partial(corridor, doors=flipping(flips), world=Corridor(doors_per_side=n))
            cases.append(SuiteCase(condition, make))
    for error in ODOMETRY_FACTORS:
        for every in SCAN_INTERVALS:
            condition = {"plane": "odometry", "odometry error, times": error,
                         "scan interval, s": SCAN_TIME * every}  # fmt: skip
            make = partial(corridor, every=every, odometry=worse(error))
            cases.append(SuiteCase(condition, make))
    for reach in LASER_RANGES:
        for flips in FLIPS_PER_MINUTE:
            condition = {"plane": "laser", "laser range, m": reach, "flips a minute": flips}
            make = partial(corridor, doors=flipping(flips), laser=Laser(max_range=reach))
            cases.append(SuiteCase(condition, make))
    return Suite("change", cases, CHANGE_VARIANTS, seeds=10)


def flipping(per_minute: float) -> Doors:
    """Doors with a mean rate of flips, their times distributed as in the paper."""
    mean, paper = 60.0 / per_minute, Uniform()
    scale = mean / (0.5 * (paper.shortest + paper.longest))
    return Doors(law=Uniform(scale * paper.shortest, scale * paper.longest))


def worse(times: float) -> Odometry:
    """Odometry whose bias and standard deviations are `times` the default."""
    usual = Odometry()
    noise = {f"alpha{k}": times**2 * getattr(usual, f"alpha{k}") for k in (1, 2, 3, 4)}
    return replace(usual, bias=times * usual.bias, **noise)


FAULT_VARIANTS = ("static-ml", "dynamic-ml", "hmm-ml", "dynamic-graph")
FAULT_WORLDS = {"corridor": "DoorCorridor-v0", "loop": "DoorLoop-v0", "office": "DoorOffice-v0"}
WHEN = (10.0, 20.0)  # s, when an event happens
CALIBRATED = Odometry(bias=0.0, alpha1=4e-4, alpha2=4e-4, alpha3=4e-4, alpha4=4e-4)  # 2 % noise
USUAL_SCALE = OdometryScale(1.01)  # and 1 % of scale, in every drive
FAULTS: dict[str, tuple[Fault, ...]] = {
    "none": (),
    "slip 0.4 m": (Slip(0.4, at=WHEN),),
    "slip 0.8 m": (Slip(0.8, at=WHEN),),
    "slip 15 deg": (Slip(0.0, math.radians(15), WHEN),),
    "slip 45 deg": (Slip(0.0, math.radians(45), WHEN),),
    "slip 90 deg": (Slip(0.0, math.radians(90), WHEN),),
    "jump 0.8 m": (Slip(0.8, at=WHEN, duration=0.1),),
    "jump 90 deg": (Slip(0.0, math.radians(90), WHEN, duration=0.1),),
    "lag 0.2 s": (Lag(0.2),),
    "lag 0.4 s": (Lag(0.4),),
    "gap 10 s": (Gap(10.0, WHEN),),
    "odometry + 20 %": (OdometryScale(1.2),),
    "20 % wrong beams": (WrongBeams(0.2),),
    "30 % missing beams": (MissingBeams(0.3),),
    "carried away": (CarriedAway(at=WHEN),),
}
"""Faults of the suite, each beside the doors and the odometry of its own."""
PEOPLE = 4
AMONG_PEOPLE = {
    "corridor": Corridor(people=PEOPLE),
    "loop": Loop(people=PEOPLE),
    "office": Office(people=PEOPLE),
}
"""Worlds of the suite's drives without a fault among people, with the odometry of the paper."""


def faults() -> Suite:
    """Faults in three worlds with good odometry: does a SLAM know that it is lost, and recover?"""
    cases = []
    for name, given in FAULTS.items():
        for world, env in FAULT_WORLDS.items():
            make = partial(drive, env, odometry=CALIBRATED, faults=(USUAL_SCALE, *given))
            cases.append(SuiteCase({"fault": name, "world": world}, make))
    for world, place in AMONG_PEOPLE.items():
        make = partial(drive, FAULT_WORLDS[world], world=place)
        cases.append(SuiteCase({"fault": "none, people", "world": world}, make))
    return Suite("faults", cases, FAULT_VARIANTS, seeds=10)


SENSOR_VARIANTS = ("static-ml", "dynamic-ml", "dynamic-graph")


def with_effects(*effects: Effect) -> dict[str, Any]:
    """Keywords for the usual laser with effects."""
    return {"laser": Laser(effects=effects)}


SENSORS: dict[str, dict[str, Any]] = {
    "none": {},
    "range noise 1 cm + 0.5 %": with_effects(RangeNoise(linear=0.005)),
    "rounded to 5 cm": with_effects(Quantisation(0.05)),
    "mixed pixels": with_effects(MixedPixels()),
    "lost echoes": with_effects(EchoLoss(reach=10.0)),
    "20 % glass": with_effects(Surfaces(glass=0.2)),
    "20 % dark": with_effects(EchoLoss(), Surfaces(dark=0.2)),
    "sweep of 0.1 s": with_effects(Sweep(0.1)),
    "late by 0.05 s": with_effects(Latency(0.05)),
    "late by 0.2 s": {"faults": (Lag(0.2),)},
    "slip of 0.4 m": {"faults": (Slip(0.4, at=WHEN),)},
    "SICK-LMS200": {"laser": "SICK-LMS200"},
    "Hokuyo-UTM-30LX": {"laser": "Hokuyo-UTM-30LX"},
    "RPLIDAR-A2": {"laser": "RPLIDAR-A2"},
    "Pioneer-3DX": {"robot": "Pioneer-3DX"},
    "TurtleBot3": {"robot": "TurtleBot3", "max_episode_steps": 2000},
}
"""Effects and presets of the suite, each beside the doors and the odometry of the paper."""


def sensors() -> Suite:
    """Lasers and robots as they are, one effect or preset at a time: what does each cost?"""
    corridor = partial(drive, "DoorCorridor-v0")
    cases = [
        SuiteCase({"sensor": name}, partial(corridor, **given)) for name, given in SENSORS.items()
    ]
    return Suite("sensors", cases, SENSOR_VARIANTS, seeds=10)


def logs(folder: Path) -> Suite:
    """All logs of a folder: CARMEN (.log, .clf, also .gz), saved episodes (.npz) and files of
    registered formats.

    Scored with NAME.relations and NAME.tum beside them, or the truth in the episode. The .npz is
    preferred to a log of the same name.
    """
    if not folder.is_dir():
        raise InputError(f"{folder}: a folder of logs was expected")
    files: dict[str, Path] = {}
    for path in sorted(folder.iterdir()):
        if not path.is_file():
            continue
        known = path.name.endswith(LOG_ENDINGS) or has_registered_reader(path)
        if known and (path.suffix == ".npz" or stem(path.name) not in files):
            files[stem(path.name)] = path.resolve()
    if not files:
        raise InputError(f"{folder}: no log in it; its name ends with {', '.join(LOG_ENDINGS)}")
    cases = [
        SuiteCase({"log": name}, partial(LogFile, path)) for name, path in sorted(files.items())
    ]
    return Suite("logs", cases, ("static-ml", "dynamic-ml", "dynamic-graph", "odometry"), seeds=1)


SUITES: dict[str, Callable[[], Suite]] = {
    "paper": paper,
    "change": change,
    "worlds": worlds,
    "faults": faults,
    "sensors": sensors,
}


def parse_variants(names: str) -> list[str]:
    """Variants of a bench by name: ours, registered ones, ceilings, and `outside:NAME`; `all` are
    those without an adapter. Raises InputError for an unknown one, with the nearest names."""
    known = [*slam.variants(), *CEILINGS]
    if names.strip() == ALL:
        return known
    files = [name.strip() for name in names.split(",") if name.strip().endswith(".toml")]
    outside = [*known_outside(), *(name for name in files if name.startswith(PREFIX))]
    return parse_selection("variant", names, [*known, *outside], LIST_VARIANTS)
