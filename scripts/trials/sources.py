"""Where episodes come from: a drive in simulation, a log, a file of an episode."""

from __future__ import annotations

import hashlib
import json
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache, cached_property
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

import agents
import dynslam_env
from agents import record_path
from dynslam_env.simulation.config import WorldConfig
from slam.episode import Episode, Truth
from slam.io.formats import read_log
from slam.preprocessing.deskewing import deskewed

SIMULATORS = ("numpy", "pymunk", "numba", "gymnasium")


class Source(ABC):
    """Gives an episode; the same one every time.

    seed  what the variants draw their random numbers from
    """

    seed: int

    @cached_property
    def key(self) -> str:
        """A name for its content, 16 hexadecimal digits."""
        return digest(self.plain())

    @abstractmethod
    def plain(self) -> dict[str, Any]:
        """What it is, as JSON: two sources of one plain form give the same episode."""

    @abstractmethod
    def make(self) -> Episode:
        """The episode; takes its time."""


@dataclass(frozen=True)
class SimulatedDrive(Source):
    """A drive along the path of a world.

    env         id of the environment
    seed        of the drive, and of the variants that are run on it
    parameters  the environment's keywords
    every       only each so many-th scan is recorded: the longer the way between two
    """

    env: str
    seed: int
    parameters: Mapping[str, Any] = field(default_factory=dict)
    every: int = 1

    def plain(self) -> dict[str, Any]:
        """With all parameters of the environment, and the code that simulates it."""
        steps, keywords = dynslam_env.WORLDS[self.env]
        given = {**keywords, **self.parameters}
        steps = given.pop("max_episode_steps", steps)
        plain = {"env": self.env, "seed": self.seed, "every": self.every, "steps": steps}
        return plain | {"config": WorldConfig.of(given).plain(), "simulator": simulator()}

    def make(self) -> Episode:
        """Record it."""
        drive = record_path(self.env, self.seed, **self.parameters)
        return drive if self.every == 1 else sparser(drive, self.every)


@dataclass(frozen=True)
class LogFile(Source):
    """A recorded log, of any format that `read_log` knows."""

    path: Path
    seed: int = 0

    def plain(self) -> dict[str, Any]:
        """Its name and what is in it."""
        content = hashlib.sha256(self.path.read_bytes()).hexdigest()
        return {"log": self.path.name, "sha256": content, "seed": self.seed}

    def make(self) -> Episode:
        """Read it."""
        return deskewed(read_log(self.path).episode)


def sparser(drive: Episode, every: int) -> Episode:
    """A simulated drive of which only each `every`-th scan was recorded, the first among them."""
    assert drive.truth is not None
    kept = slice(None, None, every)
    truth = Truth(drive.truth.poses[kept], drive.truth.walls, drive.truth.doors[kept])
    return Episode(drive.scans[kept], drive.odometry, truth, {**drive.meta, "every": every})


def digest(plain: Mapping[str, Any]) -> str:
    """16 hexadecimal digits of some JSON."""
    return hashlib.sha256(json.dumps(plain, sort_keys=True).encode()).hexdigest()[:16]


@cache
def simulator() -> str:
    """A digest of all that a drive depends on beside its parameters: our code and its libraries."""
    return code(*(Path(str(package.__file__)).parent for package in (dynslam_env, agents)))


def code(*folders: Path) -> str:
    """A digest of some of our packages, and of the libraries that drives depend on."""
    found = hashlib.sha256()
    for home in folders:
        for path in sorted(home.rglob("*.py")):
            found.update(path.relative_to(home).as_posix().encode() + path.read_bytes())
    for name in SIMULATORS:
        found.update(f"{name} {version(name)}".encode())
    return found.hexdigest()[:16]


def thinned(values: np.ndarray, most: int) -> np.ndarray:
    """At most `most` of the values, evenly spread, the last among them."""
    if len(values) <= most:
        return values
    return values[np.round(np.linspace(0, len(values) - 1, most)).astype(int)]
