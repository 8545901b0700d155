"""SLAM variants by name: name -> builder. `register` and `register_map` add custom variants.

Installed packages add theirs by entry points, available in every command without an import: in the
group `dynslam.variants` the object is a `Builder`, in `dynslam.maps` it makes a `MapModel`.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np

from slam.algorithms.ceilings import CEILINGS
from slam.algorithms.variants import BUILDERS, map_variants
from slam.errors import InputError
from slam.geometry import Pose2
from slam.interface import Builder, MapModel, Slam
from slam.plugins import load_entry_points
from slam.validation import function, unknown_name

_BUILDERS: dict[str, Builder] = dict(BUILDERS)


def register(name: str, builder: Builder) -> None:
    """Register `builder` as `name` in this process; an entry point does so in every process.

    Raises InputError for a name with spaces or commas, or that of a built-in variant.
    """
    if not name or any(c.isspace() or c == "," for c in name):
        raise InputError(f"a variant's name has no spaces or commas, got {name!r}")
    if name in BUILDERS or name in CEILINGS:
        raise InputError(f"{name!r} is one of dynslam's own variants; choose another name")
    function(f"the builder of {name!r}", builder)
    _BUILDERS[name] = builder


def register_map(
    name: str, map_model: Callable[[], MapModel], particle_filter: bool = True
) -> None:
    """Register the variants of a map model, as for the built-in maps: `NAME-ml` (with
    `/beta1`, `/beam` and `/literal`), `NAME-graph` and `NAME-pf`.

    map_model        makes a new map: a class, or a function without arguments
    particle_filter  False if the map stores anything outside its tiles, which particles share: then
                     there is no `NAME-pf`

    Raises InputError as `register`.
    """
    function(f"the map model {name!r}", map_model)
    particle_map = map_model if particle_filter else None
    for variant, builder in map_variants(name, map_model, particle_map).items():
        register(variant, builder)


def variants() -> list[str]:
    """The names of all registered variants, in the order of their registration."""
    _discover()
    return list(_BUILDERS)


def make(name: str, start: Pose2 = Pose2(), seed: int = 0) -> Slam:
    """A new SLAM of the variant `name` that starts at `start`; deterministic for a given `seed`.

    Raises InputError for an unknown name, and for a ceiling, which `build` makes from an episode.
    """
    if name in CEILINGS:
        raise InputError(
            f"{name!r} is shown the truth: it needs an episode that holds it, recorded in a "
            f"simulation, and is made by slam.build(name, episode)"
        )
    builder = builder_of(name)
    if seed < 0:  # any integer type, numpy's too
        raise InputError(f"a seed is 0 or more, got {seed}")
    return builder(start, np.random.default_rng(seed))


def builder_of(name: str) -> Builder:
    """The builder of the variant `name`; raises InputError for an unknown one."""
    if name not in _BUILDERS and name not in variants():
        raise InputError(unknown_name("SLAM variant", name, variants(), "slam.variants()"))
    return _BUILDERS[name]


@cache
def _discover() -> None:
    """Register the entry points of all installed packages, once; registered names are kept."""
    load_entry_points("dynslam.variants", _BUILDERS.__contains__, register)
    load_entry_points("dynslam.maps", lambda name: f"{name}-ml" in _BUILDERS, register_map)
