"""Names of SLAM variants: name -> builder. Users add theirs with `register` or an entry point.

A package that declares an entry point of the group `dynslam.variants`, its name the variant's and
its object a `Builder`, is known to every command without an import.
"""

from __future__ import annotations

import warnings
from functools import cache
from importlib.metadata import entry_points

import numpy as np

from slam.algorithms.ceilings import CEILINGS
from slam.algorithms.variants import BUILDERS
from slam.errors import InputError
from slam.geometry import Pose2
from slam.interface import Builder, Slam
from slam.validation import unknown_name

_BUILDERS: dict[str, Builder] = dict(BUILDERS)


def register(name: str, builder: Builder) -> None:
    """Make `builder` known as `name` in this process; an entry point makes it known in all."""
    if not name or any(c.isspace() or c == "," for c in name):
        raise InputError(f"a variant's name has no spaces or commas, got {name!r}")
    if name in BUILDERS or name in CEILINGS:
        raise InputError(f"{name!r} is one of dynslam's own variants; choose another name")
    _BUILDERS[name] = builder


def variants() -> list[str]:
    """The names of all registered variants, in the order of their registration."""
    _discover()
    return list(_BUILDERS)


def make(name: str, start: Pose2 = Pose2(), seed: int = 0) -> Slam:
    """A new SLAM of the variant `name` that begins at `start`; the same seed, the same result."""
    if name in CEILINGS:
        raise InputError(
            f"{name!r} is shown the truth: it needs an episode that holds it, recorded in a "
            f"simulation, and is made by slam.benchmark.run.build(name, episode)"
        )
    builder = builder_of(name)
    if seed < 0:
        raise InputError(f"a seed is 0 or more, got {seed}")
    return builder(start, np.random.default_rng(seed))


def builder_of(name: str) -> Builder:
    """What makes the variant `name`; raises InputError for an unknown one."""
    if name not in _BUILDERS and name not in variants():
        raise InputError(unknown_name("SLAM variant", name, variants(), "slam.variants()"))
    return _BUILDERS[name]


@cache
def _discover() -> None:
    """Register the entry points of all installed packages, once; what was registered stays.

    One that does not load is warned of and left out: it is no reason for the others to fail.
    """
    for entry in entry_points(group="dynslam.variants"):
        if entry.name in _BUILDERS:
            continue
        try:
            register(entry.name, entry.load())
        except Exception as error:
            warnings.warn(f"variant {entry.name!r} ({entry.value}): {error}", stacklevel=2)
