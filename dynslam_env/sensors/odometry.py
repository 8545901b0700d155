"""What the wheels believe the robot moved: the truth, with a systematic and a random error."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slam.geometry import Array
from slam.kernel import kernel
from slam.validation import within

Rows = NDArray[np.int64]
BLOCK = 64  # steps whose noise is drawn at once
MAX_STEP = (1.0, 1.0, math.pi)  # m, m, rad: an observed step stays within
STILL = 1e-4  # m: below it a step is a turn on the spot, and its direction means nothing


@dataclass(frozen=True)
class Odometry:
    """Both errors; either is off at zero.

    bias    rad per m travelled, believed as rotation. 3 degrees per 5 cm (the paper): a straight
            drive looks like a circle of radius 1 / bias = 0.95 m
    alpha1  rad^2 / rad^2, variance of a rotation from rotation
    alpha2  rad^2 / m^2, variance of a rotation from translation
    alpha3  m^2 / m^2, variance of a translation from translation
    alpha4  m^2 / rad^2, variance of a translation from rotation

    The alphas: Thrun, Burgard, Fox (2005), Probabilistic Robotics, table 5.6, where sample(b^2)
    draws with variance b^2.
    """

    bias: float = math.pi / 3
    alpha1: float = 0.0025
    alpha2: float = 0.001
    alpha3: float = 0.0025
    alpha4: float = 0.001

    def __post_init__(self) -> None:
        within(self, "bias", -math.inf)
        for name in ("alpha1", "alpha2", "alpha3", "alpha4"):
            within(self, name, 0.0)

    def read(
        self, which: Rows, before: Array, after: Array, noise: Array, motions: Array,
        observed: NDArray[np.float32],
    ) -> None:  # fmt: skip
        """Write the displacements that the wheels report, each in its robot's frame.

        which    rows to read
        before   (n, 3) true poses, m, m, rad; `after` likewise
        noise    (n, 3) standard normal: three numbers a step, however the robot moved
        motions  (n, 3) written, m, m, rad
        observed (n, 3) written, the same within MAX_STEP, for a Box
        """
        alphas = self.alpha1, self.alpha2, self.alpha3, self.alpha4
        _read(which, before, after, noise, self.bias, alphas, motions, observed)


class NoiseStreams:
    """Streams of noise for the wheels of n robots, one each."""

    def __init__(self, n: int):
        self._rngs: list[np.random.Generator] = [np.random.default_rng()] * n
        self._drawn, self._taken = np.zeros((n, BLOCK, 3)), np.zeros(n, dtype=np.int64)

    def begin(self, i: int, rng: np.random.Generator) -> None:
        """Robot `i` takes from `rng` from now on."""
        self._rngs[i] = rng
        self._draw(i)

    def take(self, which: Rows, noise: Array) -> None:
        """Write the next three standard normal numbers of robots `which` into `noise` (n, 3)."""
        if _take(which, self._drawn, self._taken, noise):
            for i in np.flatnonzero(self._taken == BLOCK).tolist():
                self._draw(i)

    def _draw(self, i: int) -> None:
        """numpy draws many numbers faster than few."""
        self._drawn[i], self._taken[i] = self._rngs[i].standard_normal((BLOCK, 3)), 0


@kernel
def _take(which, drawn, taken, noise):
    """Whether any robot took its last drawn numbers."""
    used_up = False
    for i in which:
        for k in range(3):
            noise[i, k] = drawn[i, taken[i], k]
        taken[i] += 1
        used_up |= taken[i] == drawn.shape[1]
    return used_up


@kernel
def _read(which, before, after, noise, bias, alphas, motions, observed):
    """Turn, drive, turn; backwards, it is turned by 180 degrees from the course."""
    a1, a2, a3, a4 = alphas
    for i in which:
        x, y, theta = before[i, 0], before[i, 1], before[i, 2]
        dx, dy = after[i, 0] - x, after[i, 1] - y
        turned = after[i, 2] - theta
        turned -= math.tau * np.rint(turned / math.tau)
        travelled = math.hypot(dx, dy)
        ahead = math.cos(theta) * dx + math.sin(theta) * dy
        aside = math.cos(theta) * dy - math.sin(theta) * dx
        forward = math.copysign(1.0, ahead)
        course = math.atan2(forward * aside, forward * ahead)
        rot1 = course if travelled > STILL else 0.0
        rot2, trans = turned - rot1, forward * travelled
        t2, r1, r2 = trans**2, rot1**2, rot2**2
        first = noise[i, 0] * math.sqrt(a1 * r1 + a2 * t2) + bias * travelled / 2
        length = noise[i, 1] * math.sqrt(a3 * t2 + a4 * (r1 + r2))
        second = noise[i, 2] * math.sqrt(a1 * r2 + a2 * t2) + bias * travelled / 2
        start, way = course + first, trans + length
        motions[i, 0], motions[i, 1] = way * math.cos(start), way * math.sin(start)
        moved = turned + first + second
        motions[i, 2] = moved - math.tau * np.rint(moved / math.tau)
        for k in range(3):
            observed[i, k] = min(max(motions[i, k], -MAX_STEP[k]), MAX_STEP[k])
