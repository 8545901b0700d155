"""Objects that the user registered in this process, sent to worker processes."""

from __future__ import annotations

from collections.abc import Iterable

import cloudpickle

import agents
import slam
from agents.registry import BUILDERS
from dynslam_env.simulation.registry import NAMED_WORLDS, register_world
from slam.errors import InputError

from ..bench.suites import shipped
from .worlds import EPISODE_STEPS


def pack_registered(names: Iterable[str], worlds: Iterable[str], variants: Iterable[str]) -> bytes:
    """The user-registered ones among agents, worlds and SLAM variants, cloudpickled.

    Built-in ones and those in files are left out: every process finds them by name. Raises
    InputError for objects that cannot be pickled.
    """
    known, places = agents.names(), NAMED_WORLDS.names()
    builders = {n: agents.builder_of(n) for n in names if n in known and n not in BUILDERS}
    generators = {w: NAMED_WORLDS.get(w) for w in worlds if w in places and w not in EPISODE_STEPS}
    systems = {v: shipped(v) for v in variants}
    try:
        return cloudpickle.dumps((builders, generators, systems))
    except Exception as error:  # pickling raises many types
        raise InputError(f"an agent or world cannot be sent to another process: {error}") from None


def register_all(packed: bytes | None) -> None:
    """Register the objects of `pack_registered` that are not registered in this process."""
    if packed is None:
        return
    builders, generators, systems = cloudpickle.loads(packed)
    for name, builder in builders.items():
        if name not in agents.names():
            agents.register(name, builder)
    for name, generator in generators.items():
        if name not in NAMED_WORLDS.names():
            register_world(name, generator)
    for name, builder in systems.items():
        if builder is not None and name not in slam.variants():
            slam.register(name, cloudpickle.loads(builder))
