"""The worlds that `dynslam evaluate` and `dynslam train` take: by name, or by file."""

from __future__ import annotations

import hashlib
import shlex
from pathlib import Path

import numpy as np

from dynslam_env.simulation.find_world import find_world
from dynslam_env.simulation.registry import NAMED_WORLDS
from dynslam_env.worlds.from_map import FromMap
from dynslam_env.worlds.layout import Generator, Layout
from slam.errors import InputError

from ..console.selection import ALL

LONG_PATROL = "DoorPatrol-v1"
PATROL_ENVS = ("DoorPatrol-v0", LONG_PATROL)
"""Ids of the environments in which agents are compared."""

EPISODE_STEPS = {"corridor": 250, "loop": 500, "office": 750, "crowd": 250}
"""Steps of 0.4 s of a patrol in each of dynslam's own worlds."""
DEFAULT_STEPS = 250  # in any other world
LONG_STEPS = 1500  # of `DoorPatrol-v1`, in any world


def steps_of(world: str, env: str) -> int:
    """Steps of 0.4 s of a patrol in a world."""
    return LONG_STEPS if env == LONG_PATROL else EPISODE_STEPS.get(world, DEFAULT_STEPS)


def parse_worlds(text: str) -> list[str]:
    """Names and files with commas between, each once; `all` registered names if that is all.

    Raises InputError for an unknown name, with the nearest known ones, for a wrong file or one of a
    place without doors, and for none.
    """
    if text.strip() == ALL:
        return list(NAMED_WORLDS.names())
    listed = list(dict.fromkeys(name.strip() for name in text.split(",") if name.strip()))
    if not listed:
        raise InputError(f"no world named; known: {', '.join([ALL, *NAMED_WORLDS.names()])}")
    for name in listed:
        _check_doors(name, find_world(name))
    return listed


def worlds_option(world: str) -> str:
    """The options of `dynslam evaluate` for a world that was trained on; of a registered one,
    floors that no training saw."""
    named = world in NAMED_WORLDS.names()
    return f"--worlds {shlex.quote(world)}" + (" --split test" if named else "")


def content_of(world: str) -> dict[str, str]:
    """A digest of the file that defines a world; empty for a registered name."""
    path = Path(world.rpartition(":")[0] if ".py:" in world else world)
    if world in NAMED_WORLDS.names() or not path.is_file():
        return {}
    return {"content": hashlib.sha256(path.read_bytes()).hexdigest()}


def _check_doors(name: str, world: Generator) -> None:
    """Raises InputError for a world file, and for a map, without doors: nothing is to patrol."""
    fixed = isinstance(world, Layout | FromMap)
    if fixed and not world.layout(np.random.default_rng(0)).doors:
        raise InputError(
            f"{name} has no doors, which agents are scored by; those of a map lie in "
            f"doors.geojson beside it (dynslam map)"
        )
