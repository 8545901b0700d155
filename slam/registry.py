"""Names of SLAM variants: name -> builder. Users add theirs with `register`."""

from __future__ import annotations

import numpy as np

from slam.algorithms.variants import BUILDERS
from slam.errors import InputError
from slam.geometry import Pose2
from slam.interface import Builder, Slam

_BUILDERS: dict[str, Builder] = dict(BUILDERS)


def register(name: str, builder: Builder) -> None:
    """Make `builder` known as `name` to every command, the wrapper and the benchmark."""
    if not name or any(c.isspace() or c == "," for c in name):
        raise InputError(f"a variant's name has no spaces or commas, got {name!r}")
    _BUILDERS[name] = builder


def variants() -> list[str]:
    """The names of all registered variants, in the order of their registration."""
    return list(_BUILDERS)


def make(name: str, start: Pose2 = Pose2(), seed: int = 0) -> Slam:
    """A new SLAM of the variant `name` that begins at `start`; the same seed, the same result."""
    if name not in _BUILDERS:
        raise InputError(f"unknown SLAM variant {name!r}; known: {', '.join(variants())}")
    return _BUILDERS[name](start, np.random.default_rng(seed))
