"""Laser: a planar scanner, by default a SICK LMS200. Ranges are exact, then noise is added.

Effects of real lasers are in `effects`; `effect_scanner` measures with them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from dynslam_env.sensors.effects import Effect, check_effects
from dynslam_env.sensors.raycast import cast, look
from slam.errors import InputError
from slam.geometry import Array, Pose2
from slam.kernel import kernel
from slam.scan import Scan
from slam.validation import finite, instance, positive, whole, within

Floats = NDArray[np.float32]
SCANS_PER_DRAW = 32  # scans whose noise is drawn at once
NO_DROPOUT = np.zeros((0, 0), dtype=np.bool_)


@dataclass(frozen=True)
class Laser:
    """Parameters of a laser scanner.

    Defaults: SICK LMS200 at 1 degree (technical description: 180 deg, 8 m in millimetre mode,
    statistical error 1 cm at most).

    beams          number of beams, evenly spaced over the field of view, both ends included
    field_of_view  rad, symmetric about straight ahead
    max_range      m; there is no echo from farther away
    min_range      m; a shorter range gives no reading
    sigma          m, standard deviation of a range
    dropout        probability that a beam gives no reading
    mount          pose of the sensor on the robot (robot_from_sensor)
    effects        of real lasers, such as `MixedPixels()`; each kind at most once, in any order
    """

    beams: int = 181
    field_of_view: float = math.pi
    max_range: float = 8.0
    min_range: float = 0.02
    sigma: float = 0.01
    dropout: float = 0.0
    mount: Pose2 = field(default=Pose2())
    effects: tuple[Effect, ...] = ()

    def __post_init__(self) -> None:
        whole(self, "beams", 1)
        positive(self, "field_of_view", "max_range")
        within(self, "field_of_view", 0.0, math.tau)
        within(self, "min_range", 0.0)
        within(self, "sigma", 0.0)
        within(self, "dropout", 0.0, 1.0)
        instance("Laser.mount", self.mount, Pose2)
        finite("Laser.mount", self.mount)
        effects = check_effects(self.effects, self.field_of_view)
        object.__setattr__(self, "effects", effects)
        if self.min_range >= self.max_range:
            raise InputError(
                f"Laser needs min_range < max_range, got {self.min_range:g} >= {self.max_range:g} m"
            )

    @property
    def angles(self) -> Array:
        """(beams,) rad, in the sensor's frame, counter-clockwise."""
        half = self.field_of_view / 2
        return np.linspace(-half, half, self.beams) if self.beams > 1 else np.zeros(1)


class Scanner:
    """Measures scans with a laser and its own stream of noise."""

    settings: Array
    """(6,) x, y, theta on the robot, min_range, max_range, sigma; m and rad."""

    fan: Array
    """(2, beams) unit vectors of the beams."""

    age: float = 0.0
    """s before the end of a control step at which the middle beam is measured."""

    def __init__(self, laser: Laser, rng: np.random.Generator):
        self.laser, self._rng = laser, rng
        self.angles, fan = _beams(laser.beams, laser.field_of_view)
        self.fan = fan.copy()
        self.settings = np.array([*laser.mount, laser.min_range, laser.max_range, laser.sigma])
        self.noise = np.empty((SCANS_PER_DRAW, laser.beams))
        """Standard normal numbers of the next scans."""
        self._lost = NO_DROPOUT
        self.taken = np.zeros(1, dtype=np.int64)
        """How many scans have taken their noise."""
        self.hits = np.empty(laser.beams, dtype=np.int32)
        """(beams,) index of the segment that each beam of the last scan hit, -1 for none."""

    def exact(self, pose: Pose2, segments: Array, first_edge: int | None = None) -> Array:
        """(beams,) m, ranges without noise from the robot at `pose`; inf for no hit."""
        ranges = np.empty(self.laser.beams)
        at, limit = pose @ self.laser.mount, self.laser.max_range
        edge = len(segments) if first_edge is None else first_edge
        cast(at.x, at.y, at.theta, self.fan, segments, edge, limit, ranges, self.hits)
        return ranges

    def look(
        self, pose: Array, segments: Array, first_edge: int, ranges: Array, observed: Floats
    ) -> None:
        """Measure a scan from the robot at `pose` (3,), m, m, rad.

        segments    (n, 4) m; from index `first_edge` on, edges of solid polygons in
                    counter-clockwise order, whose far sides are invisible
        ranges      (beams,) m, written: inf for no echo, NaN for no reading
        observed    (beams,) float32 m, written: the same, but max_range for no echo, 0 for no
                    reading
        """
        row = self.next_row()
        look(pose, self.settings, self.fan, segments, first_edge,
             row, self.noise, self._lost, ranges, observed, self.hits)  # fmt: skip

    def scan(self, ranges: Array, time: float) -> Scan:
        """Measured ranges as a `Scan`."""
        laser = self.laser
        return Scan(ranges, self.angles, laser.max_range, laser.min_range, time, laser.mount)

    def carried(self) -> None:
        """The robot was put down elsewhere since the last scan."""

    def next_row(self) -> int:
        """The row of the noise for the next scan."""
        row = int(self.taken[0]) % SCANS_PER_DRAW
        if row == 0:
            self.draw()
        self.taken[0] += 1
        return row

    def draw(self) -> None:
        """Draw the noise of the next SCANS_PER_DRAW scans: fewer calls of numpy are faster."""
        laser, shape = self.laser, (SCANS_PER_DRAW, self.laser.beams)
        fill_normal(self._rng, self.noise)
        if laser.dropout:
            self._lost = self._rng.random(shape) < laser.dropout


@lru_cache(maxsize=16)
def _beams(beams: int, field_of_view: float) -> tuple[Array, Array]:
    """Angles (beams,), rad, and unit vectors (2, beams) of the beams; neither can be written to."""
    angles = Laser(beams, field_of_view).angles
    fan = np.stack([np.cos(angles), np.sin(angles)])
    angles.flags.writeable = fan.flags.writeable = False
    return angles, fan


@kernel
def fill_normal(rng, numbers):
    """Fill `numbers` (m, n) with those of `rng.standard_normal`, in 0.4 of its time."""
    for k in range(len(numbers)):
        for j in range(numbers.shape[1]):
            numbers[k, j] = rng.standard_normal()
