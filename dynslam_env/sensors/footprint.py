"""Kernels of `EffectScanner`: rays of a sweep, what glass and edges make of them, the reading."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from dynslam_env.sensors.raycast import cast
from slam.kernel import kernel

GROUP_SHARE = 0.02  # of a control step: beams within this time are cast from one place, that of
# their middle, each in its own direction. A robot at 1.2 m/s moves 1.2 mm from there to the ends


class SweptFan(NamedTuple):
    """The fan of a laser that moves while it sweeps.

    beams           number of beams
    first, spacing  rad, first angle in the sensor's frame and the next ones
    begun, per_beam times of the beams as shares of a control step; 1 is its end
    mount_x, mount_y, mount_theta  m, m, rad
    """

    beams: int
    first: float
    spacing: float
    begun: float
    per_beam: float
    mount_x: float
    mount_y: float
    mount_theta: float


class MovingScene(NamedTuple):
    """Poses (3,) and segments (n, 4) at the beginning and at the end of a control step.

    first_edge  index of the first segment of a solid that moves
    """

    pose_before: np.ndarray
    pose: np.ndarray
    segments_before: np.ndarray
    segments: np.ndarray
    first_edge: int


class EchoPower(NamedTuple):
    """What decides which echo is heard: fields of `EchoLoss` and `Surfaces`; reach 0 for no loss.

    visible  cosine of the largest incidence at which glass is seen
    merging  m, of `MixedPixels`
    """

    reach: float
    sharpness: float
    share: float
    ordinary: float
    dark: float
    transmission: float
    visible: float
    merging: float


@kernel(error_model="numpy")
def sweep(fan: SweptFan, scene: MovingScene, offset, max_range, ranges, hits):
    """Cast the beams, each `offset` rad beside its middle, from where the laser is at its time.

    ranges, hits  (beams,) written: m, inf for none; index of the segment, -1 for none
    """
    size = fan.beams
    if fan.per_beam > 0.0:
        size = min(max(int(GROUP_SHARE / fan.per_beam), 1), fan.beams)
    before, now = scene.pose_before, scene.pose
    turn = now[2] - before[2]
    spacing = fan.spacing + turn * fan.per_beam
    for start in range(0, fan.beams, size):
        count = min(size, fan.beams - start)
        middle = start + (count - 1) / 2
        share = fan.begun + middle * fan.per_beam
        x, y = before[0] + share * (now[0] - before[0]), before[1] + share * (now[1] - before[1])
        theta = before[2] + share * turn
        c, s = math.cos(theta), math.sin(theta)
        x, y = x + c * fan.mount_x - s * fan.mount_y, y + s * fan.mount_x + c * fan.mount_y
        segments = scene.segments
        if share < 1.0:
            segments = _segments_at(scene, share)
        rays = np.empty((2, count))
        for b in range(count):
            angle = (b - (count - 1) / 2) * spacing
            rays[0, b], rays[1, b] = math.cos(angle), math.sin(angle)
        heading = theta + fan.mount_theta + fan.first + middle * fan.spacing + offset
        stop = start + count
        cast(x, y, heading, rays, segments, scene.first_edge, max_range,
             ranges[start:stop], hits[start:stop])  # fmt: skip


@kernel
def _segments_at(scene: MovingScene, share):
    """The segments at a time within the step."""
    segments = scene.segments.copy()
    for i in range(scene.first_edge, len(segments)):
        for k in range(4):
            was = scene.segments_before[i, k]
            segments[i, k] = was + share * (segments[i, k] - was)
    return segments


@kernel(error_model="numpy")
def see_through(segments, panes, directions, visible, ranges, hits, behind, behind_hits):
    """Let the rays pass through glass, except those that meet it nearly at a right angle.

    panes                 (n,) bool, segments of glass
    directions            (beams,) rad, world, of the rays
    ranges, hits          (beams,) of the nearest surfaces, overwritten by those behind glass
    behind, behind_hits   (beams,) of the nearest surfaces that are not of glass
    Returns (beams,) bool: whether the ray passed through glass.
    """
    passed = np.zeros(len(ranges), dtype=np.bool_)
    for b in range(len(ranges)):
        i = hits[b]
        if i >= 0 and panes[i] and incidence(segments, i, directions[b]) < visible:
            passed[b] = True
            ranges[b], hits[b] = behind[b], behind_hits[b]
    return passed


@kernel(error_model="numpy")
def incidence(segments, i, direction):
    """Cosine of the angle between a ray and the normal of segment `i`."""
    dx, dy = segments[i, 2] - segments[i, 0], segments[i, 3] - segments[i, 1]
    across = dx * math.sin(direction) - dy * math.cos(direction)
    return abs(across) / math.hypot(dx, dy)


@kernel(error_model="numpy")
def merge(rays, ray_hits, passed, merging, middle, ranges, hits, through):
    """Merge the rays (k, beams) of each beam to one echo: see `MixedPixels`.

    middle                 the ray that stands for the beam where all rays hit one surface
    ranges, hits, through  (beams,) written: range, segment, whether the echo came through glass
    """
    for b in range(rays.shape[1]):
        nearest, alike = middle, True
        for k in range(len(rays)):
            alike &= ray_hits[k, b] == ray_hits[middle, b]
            if rays[k, b] < rays[nearest, b]:
                nearest = k
        if alike:
            nearest = middle
        hits[b], through[b] = ray_hits[nearest, b], passed[nearest, b]
        ranges[b] = rays[nearest, b]
        if not alike:
            total, count = 0.0, 0
            for k in range(len(rays)):
                if rays[k, b] <= rays[nearest, b] + merging:
                    total, count = total + rays[k, b], count + 1
            ranges[b] = total / count


@kernel(error_model="numpy")
def lose(segments, dark, directions, power: EchoPower, chances, hits, through, ranges):
    """Lose weak echoes: they become inf. See `EchoLoss`.

    dark     (n,) bool, dark segments
    chances  (beams,) uniform random numbers
    """
    for b in range(len(ranges)):
        i = hits[b]
        if i < 0:
            continue
        given = power.dark if dark[i] else power.ordinary
        if through[b]:
            given *= power.transmission
        cosine = incidence(segments, i, directions[b])
        q = (power.reach / max(ranges[b], 1e-6)) ** 2 * given * cosine
        heard = (1.0 - power.share) * (1.0 - 1.0 / (1.0 + q**power.sharpness))
        if chances[b] >= heard:
            ranges[b], hits[b] = np.inf, -1


@kernel(error_model="numpy")
def read(settings, growth, step, noise, lost, ranges, observed):
    """Add the noise, round, and write what the laser reports; as `raycast.look` does.

    settings  x, y, theta of the sensor on the robot, min_range, max_range, sigma; m and rad
    growth    (2,) of the noise: m per m and m per m^2
    step      m, to whose multiples ranges are rounded; 0: not
    noise     (beams,) standard normal
    lost      (beams,) bool, beams without a reading; (0,) without dropout
    """
    min_range, max_range, sigma = settings[3], settings[4], settings[5]
    for b in range(len(ranges)):
        r = ranges[b]
        if np.isfinite(r):
            r += (sigma + growth[0] * r + growth[1] * r * r) * noise[b]
            if step > 0.0:
                r = np.rint(r / step) * step
        if r < min_range or (len(lost) > 0 and lost[b]):
            ranges[b], observed[b] = np.nan, 0.0
        elif r >= max_range:
            ranges[b], observed[b] = np.inf, max_range
        else:
            ranges[b] = observed[b] = r
