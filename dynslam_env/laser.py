"""A planar laser scanner: exact ranges to all segments, then noise. A SICK LMS200 by default."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numba import njit

from slam.checked import finite, instance, positive, whole, within
from slam.errors import InputError
from slam.geometry import Array, Pose2
from slam.scan import Scan


@dataclass(frozen=True)
class Laser:
    """The sensor.

    Defaults: SICK LMS200 at 1 degree (technical description: 180 deg, 8 m in millimetre mode,
    statistical error 1 cm at most).

    beams          number of rays, spread evenly over the field of view, both borders included
    field_of_view  rad, symmetric about straight ahead
    max_range      m, nothing is heard from beyond
    min_range      m, a nearer reading is none at all
    sigma          m, standard deviation of a range
    dropout        probability that a beam gives no reading at all
    mount          the sensor on the robot (robot_from_sensor)
    """

    beams: int = 181
    field_of_view: float = math.pi
    max_range: float = 8.0
    min_range: float = 0.02
    sigma: float = 0.01
    dropout: float = 0.0
    mount: Pose2 = field(default=Pose2())

    def __post_init__(self) -> None:
        whole(self, "beams", 1)
        positive(self, "field_of_view", "max_range")
        within(self, "field_of_view", 0.0, math.tau)
        within(self, "min_range", 0.0)
        within(self, "sigma", 0.0)
        within(self, "dropout", 0.0, 1.0)
        instance("Laser.mount", self.mount, Pose2)
        finite("Laser.mount", self.mount)
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
    """A laser at work, with a stream of noise of its own."""

    def __init__(self, laser: Laser, rng: np.random.Generator):
        self.laser, self._rng = laser, rng
        self.angles = laser.angles
        self.angles.flags.writeable = False
        self._directions = np.stack([np.cos(self.angles), np.sin(self.angles)])

    def exact(self, pose: Pose2, segments: Array) -> Array:
        """(beams,) m, ranges without noise from the robot at `pose`; inf where nothing is hit."""
        at = pose @ self.laser.mount
        return cast(at.x, at.y, at.theta, self._directions, segments, self.laser.max_range)

    def ranges(self, pose: Pose2, segments: Array) -> Array:
        """(beams,) m, as measured: inf for no echo, NaN for no reading."""
        laser, rng = self.laser, self._rng
        ranges = self.exact(pose, segments)
        ranges += laser.sigma * rng.standard_normal(laser.beams)
        ranges[ranges < laser.min_range] = np.nan
        ranges[ranges >= laser.max_range] = np.inf
        if laser.dropout:
            ranges[rng.random(laser.beams) < laser.dropout] = np.nan
        return ranges

    def scan(self, ranges: Array, time: float) -> Scan:
        """What was measured, as a SLAM takes it."""
        laser = self.laser
        return Scan(ranges, self.angles, laser.max_range, laser.min_range, time, laser.mount)

    def observed(self, ranges: Array) -> np.ndarray:
        """(beams,) float32 m for a Box: no echo is max_range, no reading is 0."""
        observed = np.minimum(ranges, self.laser.max_range).astype(np.float32)
        observed[np.isnan(observed)] = 0.0
        return observed


@njit(cache=True, nogil=True, error_model="numpy")
def cast(x, y, theta, directions, segments, max_range):
    """Ranges from a sensor at (x, y, theta) along `directions` (2, beams), m; inf for none.

    A segment from p to q has a normal n, and the ray r d meets its line where r n.d = n.p. With
    m = n / n.p that is 1/r = m.d: the nearest hit is the largest inverse range, without a division.
    d meets the segment itself if p and q lie on different sides of d. Single precision finds
    *which* segment is hit; double precision then says where.

    segments (n, 4) x1, y1, x2, y2, m. Returns (beams,), double precision.
    """
    beams = directions.shape[1]
    dx, dy = directions[0].astype(np.float32), directions[1].astype(np.float32)
    nearest = np.full(beams, np.float32(1.0 / max_range))
    winner = np.full(beams, np.int32(-1))
    lines = np.empty((len(segments), 3))
    c, s = math.cos(theta), math.sin(theta)
    for i in range(len(segments)):
        x1, y1, x2, y2 = segments[i]
        px, py = c * (x1 - x) + s * (y1 - y), c * (y1 - y) - s * (x1 - x)
        qx, qy = c * (x2 - x) + s * (y2 - y), c * (y2 - y) - s * (x2 - x)
        nx, ny = py - qy, qx - px
        offset = nx * px + ny * py
        lines[i, 0], lines[i, 1], lines[i, 2] = nx, ny, offset
        if abs(offset) > 1e-12:  # else the sensor sees it edge-on
            _nearer(px, py, qx, qy, nx / offset, ny / offset, dx, dy, nearest, winner, i)
    ranges = np.full(beams, np.inf)
    for b in range(beams):
        i = winner[b]
        if i >= 0:
            n_d = lines[i, 0] * directions[0, b] + lines[i, 1] * directions[1, b]
            ranges[b] = lines[i, 2] / n_d
    return ranges


@njit(cache=True, nogil=True, error_model="numpy")
def _nearer(px, py, qx, qy, mx, my, dx, dy, nearest, winner, i):
    """Put segment number `i` in wherever its inverse range is larger than the `nearest` so far."""
    px, py, qx, qy = np.float32(px), np.float32(py), np.float32(qx), np.float32(qy)
    mx, my, i = np.float32(mx), np.float32(my), np.int32(i)
    for b in range(len(dx)):
        inverse = mx * dx[b] + my * dy[b]
        side_p = px * dy[b] - py * dx[b]
        side_q = qx * dy[b] - qy * dx[b]
        hit = (side_p * side_q <= 0) & (inverse > nearest[b])
        nearest[b] = inverse if hit else nearest[b]
        winner[b] = i if hit else winner[b]
