"""Sources of episodes: simulated drives and recordings."""

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
from dynslam_env.registration import spec_of
from dynslam_env.simulation.config import WorldConfig
from slam.episode import Episode, Truth
from slam.io.files import reading
from slam.io.formats import read_log
from slam.preprocessing.clock import synchronised
from slam.preprocessing.deskewing import deskewed

SIMULATION_LIBRARIES = ("numpy", "pymunk", "numba", "gymnasium")


class Source(ABC):
    """Gives an episode, the same one every time.

    seed  of the variants' random numbers
    """

    seed: int

    @cached_property
    def key(self) -> str:
        """Name of the content, 16 hexadecimal digits."""
        return digest(self.plain())

    @abstractmethod
    def plain(self) -> dict[str, Any]:
        """Description in JSON; sources with equal descriptions give the same episode."""

    @abstractmethod
    def make(self) -> Episode:
        """Make the episode; slow."""


@dataclass(frozen=True)
class SimulatedDrive(Source):
    """A drive along the path of a world.

    env         id of the environment
    seed        of the drive and of the variants that run on it; with a split, the drive's index
    parameters  the environment's keywords
    every       records only each `every`-th scan
    code        digest of the user's code that the parameters hold, if any
    split       "train", "validation" or "test"
    """

    env: str
    seed: int
    parameters: Mapping[str, Any] = field(default_factory=dict)
    every: int = 1
    code: str = ""
    split: str | None = None

    def plain(self) -> dict[str, Any]:
        """Description with all parameters of the environment and a digest of the simulator."""
        spec = spec_of(self.env)
        given = {**spec.kwargs, **self.parameters}
        steps = given.pop("max_episode_steps", spec.max_episode_steps)
        plain = {"env": self.env, "seed": self.seed, "every": self.every, "steps": steps}
        plain |= {"code": self.code} if self.code else {}
        plain |= {"split": self.split} if self.split else {}
        return plain | {"config": WorldConfig.of(given).plain(), "simulator": simulator()}

    def make(self) -> Episode:
        """Record it."""
        drive = record_path(self.env, self.seed, split=self.split, **self.parameters)
        return drive if self.every == 1 else sparser(drive, self.every)


@dataclass(frozen=True)
class LogFile(Source):
    """A recording in any format of `read_log`."""

    path: Path
    seed: int = 0

    def plain(self) -> dict[str, Any]:
        """Its name and a digest of its content."""
        with reading(self.path) as file:  # of any size
            content = hashlib.file_digest(file, "sha256").hexdigest()  # pyright: ignore[reportArgumentType]
        return {"log": self.path.name, "sha256": content, "seed": self.seed, "clock": "auto"}

    def make(self) -> Episode:
        """Read it."""
        return deskewed(synchronised(read_log(self.path).episode))


def sparser(drive: Episode, every: int) -> Episode:
    """A simulated drive with only each `every`-th scan, from the first on."""
    assert drive.truth is not None
    kept = slice(None, None, every)
    truth = Truth(drive.truth.poses[kept], drive.truth.walls, drive.truth.doors[kept])
    return Episode(drive.scans[kept], drive.odometry, truth, {**drive.meta, "every": every})


def digest(plain: Mapping[str, Any]) -> str:
    """Digest of some JSON, 16 hexadecimal digits."""
    return hashlib.sha256(json.dumps(plain, sort_keys=True).encode()).hexdigest()[:16]


@cache
def simulator() -> str:
    """Digest of what a drive depends on beside its parameters: our code and its libraries."""
    return code_digest(*(Path(str(package.__file__)).parent for package in (dynslam_env, agents)))


def code_digest(*folders: Path) -> str:
    """Digest of some of our packages and of the libraries that drives depend on."""
    found = hashlib.sha256()
    for home in folders:
        for path in sorted(home.rglob("*.py")):
            found.update(path.relative_to(home).as_posix().encode() + path.read_bytes())
    for name in SIMULATION_LIBRARIES:
        found.update(f"{name} {version(name)}".encode())
    return found.hexdigest()[:16]


def thinned(values: np.ndarray, max_count: int) -> np.ndarray:
    """At most `max_count` of the values, evenly spread, with the last one."""
    if len(values) <= max_count:
        return values
    return values[np.round(np.linspace(0, len(values) - 1, max_count)).astype(int)]
