"""Odometry: what the wheels report of a step. The default is the true displacement with errors."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from slam.geometry import Array
from slam.kernel import kernel
from slam.validation import within

Rows = NDArray[np.int64]
STEPS_PER_DRAW = 64  # steps whose noise is drawn at once
MAX_DISPLACEMENT = (1.0, 1.0, math.pi)  # m, m, rad: bounds of the observation
MIN_TRANSLATION = 1e-4  # m: a shorter step counts as a turn on the spot


class StepMotion(NamedTuple):
    """What n robots and their wheels did in a step.

    before, after  (n, 3) true poses, m, m, rad
    rolled         (n, 2) what the wheels turned: ahead in m, to the left in rad. The robot's own
                   way where the wheels do not slip
    """

    before: Array
    after: Array
    rolled: Array


class OdometrySensor(Protocol):
    """The odometry of n robots during their episodes."""

    def reset(self, i: int) -> None:
        """Begin an episode of robot `i`."""
        ...

    def read(
        self, which: Rows, motion: StepMotion, noise: Array, displacements: Array,
        observed: NDArray[np.float32],
    ) -> None:  # fmt: skip
        """Write the displacements by odometry, each in the robot's frame before the step.

        which          rows to write
        noise          (n, 3) standard normal; every step takes three numbers from the stream
        displacements  (n, 3) written, m, m, rad
        observed       (n, 3) written, the same clipped to MAX_DISPLACEMENT
        """
        ...


@runtime_checkable
class OdometryModel(Protocol):
    """A kind of odometry: `Odometry` or `WheelEncoders`. One object serves any number of robots."""

    def sensor(self, n: int, wheel_base: float) -> OdometrySensor:
        """The odometry of n robots whose wheels are `wheel_base` m apart."""
        ...


@dataclass(frozen=True)
class Odometry:
    """The true displacement with errors. It reports the body: wheels that turn against a wall are
    not heard (see `WheelEncoders`).

    Parameters of the systematic error (bias) and the random error (alphas); 0 turns one off.

    bias    rad of false rotation per m travelled. The paper's 3 degrees per 5 cm turn a straight
            drive into a circle of radius 1 / bias = 0.95 m
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

    def sensor(self, n: int, wheel_base: float) -> OdometrySensor:
        """See `OdometryModel`."""
        return _BodyOdometry(self)

    def read(
        self, which: Rows, before: Array, after: Array, noise: Array, displacements: Array,
        observed: NDArray[np.float32],
    ) -> None:  # fmt: skip
        """Write the displacements by odometry, each in the robot's frame before the step.

        which          rows to write
        before, after  (n, 3) true poses before and after the step, m, m, rad
        noise          (n, 3) standard normal; every step uses three numbers
        displacements  (n, 3) written, m, m, rad
        observed       (n, 3) written, the same clipped to MAX_DISPLACEMENT
        """
        alphas = self.alpha1, self.alpha2, self.alpha3, self.alpha4
        read_displacements(which, before, after, noise, self.bias, alphas, displacements, observed)


class _BodyOdometry:
    """An `OdometrySensor` without a state of its own."""

    def __init__(self, model: Odometry):
        self._model = model

    def reset(self, i: int) -> None:
        pass

    def read(
        self, which: Rows, motion: StepMotion, noise: Array, displacements: Array,
        observed: NDArray[np.float32],
    ) -> None:  # fmt: skip
        before, after, _ = motion
        self._model.read(which, before, after, noise, displacements, observed)


class NoiseStreams:
    """Streams of standard normal numbers, one for the odometry of each of n robots.

    drawn  (n, STEPS_PER_DRAW, 3) numbers of each stream
    taken  (n,) how many triples of these are used up
    """

    def __init__(self, n: int):
        self._rngs: list[np.random.Generator] = [np.random.default_rng()] * n
        self.drawn, self.taken = np.zeros((n, STEPS_PER_DRAW, 3)), np.zeros(n, dtype=np.int64)

    def reset(self, i: int, rng: np.random.Generator) -> None:
        """Let robot `i` draw from `rng` from now on."""
        self._rngs[i] = rng
        self.draw(i)

    def draw(self, i: int) -> None:
        """Draw the noise of the next STEPS_PER_DRAW steps: fewer calls of numpy are faster."""
        self.drawn[i], self.taken[i] = self._rngs[i].standard_normal((STEPS_PER_DRAW, 3)), 0


@kernel
def read_velocities(which, displacements, dt, limits, velocities):
    """Write the mean velocities of a step by odometry: those of the arc to its displacement.

    displacements  (n, 3) m, m, rad, in a step of `dt` s
    limits         (2,) m/s, rad/s, bounds of the observation space
    velocities     (n, 2) float32, written: m/s forward, rad/s turning
    """
    for i in which:
        dx, half = displacements[i, 0], displacements[i, 2] / 2
        chord = math.copysign(math.hypot(dx, displacements[i, 1]), dx)
        way = chord * half / math.sin(half) if half else chord
        velocities[i, 0] = min(max(way / dt, -limits[0]), limits[0])
        velocities[i, 1] = min(max(2 * half / dt, -limits[1]), limits[1])


@kernel
def take(which, drawn, taken, noise):
    """Copy the next three of the numbers of `NoiseStreams` into `noise` (n, 3)."""
    for i in which:
        for k in range(3):
            noise[i, k] = drawn[i, taken[i], k]
        taken[i] += 1


@kernel
def read_displacements(which, before, after, noise, bias, alphas, displacements, observed):
    """Decompose into rotation, translation (negative if backwards), rotation; add the errors."""
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
        rot1 = course if travelled > MIN_TRANSLATION else 0.0
        rot2, trans = turned - rot1, forward * travelled
        t2, r1, r2 = trans**2, rot1**2, rot2**2
        first = noise[i, 0] * math.sqrt(a1 * r1 + a2 * t2) + bias * travelled / 2
        length = noise[i, 1] * math.sqrt(a3 * t2 + a4 * (r1 + r2))
        second = noise[i, 2] * math.sqrt(a1 * r2 + a2 * t2) + bias * travelled / 2
        start, way = course + first, trans + length
        displacements[i, 0], displacements[i, 1] = way * math.cos(start), way * math.sin(start)
        moved = turned + first + second
        displacements[i, 2] = moved - math.tau * np.rint(moved / math.tau)
        for k in range(3):
            observed[i, k] = min(
                max(displacements[i, k], -MAX_DISPLACEMENT[k]), MAX_DISPLACEMENT[k]
            )
