"""Variants that go wrong, each in its own way; each is what a user might register."""

import ctypes
import os
import sys
import time
from collections.abc import Callable

import numpy as np

from slam.algorithms.variants import BUILDERS
from slam.geometry import Pose2
from slam.grid import OccupancyGrid
from slam.interface import Estimate, Slam
from slam.scan import Scan

GOOD = "good one"  # is said on standard output, as a careless variant would


class Breaking:
    """Dead reckoning that does something at scan number 100."""

    def __init__(self, start: Pose2, rng: np.random.Generator, what: Callable[[], None]):
        self._inner: Slam = BUILDERS["odometry"](start, rng)
        self._what, self._scans = what, 0

    def update(self, displacement: Pose2, scan: Scan) -> Estimate:
        self._scans += 1
        if self._scans == 100:
            self._what()
        return self._inner.update(displacement, scan)

    def map(self) -> OccupancyGrid:
        return self._inner.map()

    @property
    def pose(self) -> Pose2:
        return self._inner.pose


class Lost(Breaking):
    def update(self, displacement: Pose2, scan: Scan) -> Estimate:
        estimate = super().update(displacement, scan)
        return estimate._replace(pose=Pose2(np.nan, 0.0, 0.0)) if self._scans > 100 else estimate


class Far(Breaking):
    """Finite, and its error too large for a number."""

    def update(self, displacement: Pose2, scan: Scan) -> Estimate:
        return super().update(displacement, scan)._replace(pose=Pose2(1e200, 0.0, 0.0))


class Numpys(Breaking):
    """Says with a numpy bool whether it matched."""

    def update(self, displacement: Pose2, scan: Scan) -> Estimate:
        estimate = super().update(displacement, scan)
        return estimate._replace(matched=np.bool_(True))  # pyright: ignore[reportArgumentType]


class Late(Breaking):
    """Has no map on the way."""

    def map(self) -> OccupancyGrid:
        if self._scans < 100:
            raise ValueError("too early")
        return super().map()


def raises() -> None:
    raise ZeroDivisionError("nothing to divide by")


def sleeps() -> None:
    time.sleep(60)


def holds() -> None:
    """In a call that does not give back the interpreter's lock, as one of numba does not."""
    ctypes.PyDLL(None).sleep(60)


def leaves() -> None:
    print("these are my last words", file=sys.stderr, flush=True)
    os._exit(3)


def crashes() -> None:
    os.kill(os.getpid(), 11)


def talks() -> None:
    print(GOOD)
    os.write(1, GOOD.encode())


def builder(what: Callable[[], None], kind: type = Breaking):
    return lambda start, rng: kind(start, rng, what)


BROKEN = {
    "raises": builder(raises),
    "lost": builder(talks, Lost),
    "sleeps": builder(sleeps),
    "holds": builder(holds),
    "leaves": builder(leaves),
    "crashes": builder(crashes),
    "talks": builder(talks),
    "far": builder(talks, Far),
    "numpys": builder(talks, Numpys),
    "late": builder(talks, Late),
}
