"""Gaps of a door's width in straight walls: doors that may not have moved in sight.

A closed leaf is set back from the faces of its wall, and an open one stands beside its gap. So a
wall that ends at a place, and goes on in the same line one door's width farther, has a gap there:
with a leaf that is set back, or with free space and perhaps the open leaf beside it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from slam.geometry import Array
from slam.grid import GridSpec
from slam.kernel import kernel
from slam.layers.surface import SurfaceCells

MIN_WIDTH, MAX_WIDTH = 0.55, 1.3  # m
BIN = 0.05  # m, of the lengths into which a wall is divided
FLANK, AHEAD, REACH = 10, 6, 42  # BINs of wall beside a gap, to the begin of one, to the end of all
MIN_FLANK, MIN_FAR_FLANK = 6, 3  # of the FLANK lengths on one side and the other that have wall
MAX_STRAY = 2  # lengths within a gap that have wall
NEAR_LINE = 0.07  # m from the line along a cell's normal, of the wall that a line is fitted to
ON_LINE, LINE_ERROR = 0.035, 0.008  # m from the fitted line, and more per m, of the wall's cells
MAX_DEVIATION = 0.03  # m, of a wall from its line; ...
STRAIGHT = 0.02  # ... of one that is so straight that a recess in it is one
SAME_DISTANCE = 0.08  # m between the ends of two gaps that are one
NO_GAP = -1.0


class WallGap(NamedTuple):
    """A gap in a wall.

    ends      (2, 2) m, map frame, on a face of the wall
    straight  whether the walls beside it are so straight that the shape of the gap tells anything;
              where poses err by some cm, they are not
    """

    ends: Array
    straight: bool


def find_wall_gaps(wall: np.ndarray, spec: GridSpec, surface: SurfaceCells) -> list[WallGap]:
    """The gaps, those of the straightest walls first, without gaps with the same ends.

    wall  (rows, cols) bool, cells that always stood
    """
    found = _wall_gaps(wall, surface.number, surface.places, surface.normals, spec.origin,
                       1 / spec.resolution)  # fmt: skip
    ends = found[:, :4].reshape(-1, 2, 2)
    straight = (found[:, 5] <= STRAIGHT) & (found[:, 6] <= 2 * STRAIGHT)
    kept: list[int] = []
    for k in np.lexsort((found[:, 4], ~straight)).tolist():
        if not kept or _apart(ends[kept], ends[k]).min() > SAME_DISTANCE:
            kept.append(k)
    return [WallGap(ends[k], bool(straight[k])) for k in kept]


def _apart(gaps: Array, gap: Array) -> Array:
    """(n,) m: the larger distance between the ends of each of the gaps (n, 2, 2) and of `gap`
    (2, 2), whichever end is the first."""
    ways = [np.hypot(*(gaps - one).transpose(2, 0, 1)).max(axis=1) for one in (gap, gap[::-1])]
    return np.minimum(*ways)


@kernel
def _wall_gaps(wall, number, places, normals, origin, scale):
    """(n, 7) ends of each gap, and the deviation of the walls from its line, m: the sum of both
    sides, that before the gap, and that behind it."""
    found, n = np.empty((64, 7)), 0
    lengths = np.empty((3, FLANK + REACH))  # of each: whether it has wall, its end and its begin, m
    for row in range(wall.shape[0]):
        for col in range(wall.shape[1]):
            i = number[row, col]
            if i < 0 or not wall[row, col] or (normals[i] == 0.0).all():
                continue
            for sense in (-1.0, 1.0):
                line = places[i, 0], places[i, 1], -sense * normals[i, 1], sense * normals[i, 0]
                line, deviation = _fitted(line, wall, number, places, origin, scale)
                if deviation > MAX_DEVIATION:
                    continue
                gap = _gap(line, wall, number, places, origin, scale, lengths)
                if gap[0] != NO_GAP:
                    if n == len(found):
                        found = np.concatenate((found, np.empty_like(found)))
                    x, y, tx, ty = line
                    found[n, 0], found[n, 1] = x + gap[0] * tx, y + gap[0] * ty
                    found[n, 2], found[n, 3] = x + gap[1] * tx, y + gap[1] * ty
                    found[n, 4] = deviation + gap[2]
                    found[n, 5], found[n, 6] = deviation, gap[2]
                    n += 1
    return found[:n]


@kernel
def _cell(line, along, aside, number, origin, scale):
    """The number of the surface cell at a place beside a line, -1 if there is none."""
    x, y, tx, ty = line
    row = int(np.floor((y + along * ty + aside * tx - origin[1]) * scale))
    col = int(np.floor((x + along * tx - aside * ty - origin[0]) * scale))
    if row < 0 or col < 0 or row >= number.shape[0] or col >= number.shape[1]:
        return row, col, -1
    return row, col, number[row, col]


@kernel
def _fitted(line, wall, number, places, origin, scale):
    """The line fitted to the wall behind the begin of `line`, and the wall's deviation, m; infinite
    if there is too little of it."""
    x, y, tx, ty = line
    sums, covered = np.zeros(5), 0
    for k in range(-FLANK, 1):
        before = sums[0]
        for side in range(-2, 3):
            row, col, j = _cell(line, k * BIN, side / scale, number, origin, scale)
            if j >= 0 and wall[row, col]:
                dx, dy = places[j, 0] - x, places[j, 1] - y
                along, across = dx * tx + dy * ty, dy * tx - dx * ty
                if abs(across) < NEAR_LINE:
                    sums += np.array((1.0, along, across, along * along, along * across))
        covered += sums[0] > before
    if covered < MIN_FLANK:
        return line, np.inf
    n, u, v, uu, uv = sums
    slope = (uv - u * v / n) / (uu - u * u / n)
    offset = (v - slope * u) / n
    norm = np.hypot(1.0, slope)
    line = (
        x - offset * ty, y + offset * tx, (tx - slope * ty) / norm, (ty + slope * tx) / norm
    )  # fmt: skip
    return line, _deviation(line, -FLANK, 1, wall, number, places, origin, scale)


@kernel
def _deviation(line, first, last, wall, number, places, origin, scale):
    """Deviation (root of the mean square) of a wall from a line, m, between two of its lengths."""
    x, y, tx, ty = line
    n, total = 0, 0.0
    for k in range(first, last):
        for side in range(-2, 3):
            row, col, j = _cell(line, k * BIN, side / scale, number, origin, scale)
            if j >= 0 and wall[row, col]:
                across = (places[j, 1] - y) * tx - (places[j, 0] - x) * ty
                if abs(across) < NEAR_LINE:
                    n += 1
                    total += across * across
    return np.sqrt(total / n) if n else np.inf


@kernel
def _gap(line, wall, number, places, origin, scale, lengths):
    """Begin and end of a gap along a line, m, and the deviation of the wall behind it from the
    line; NO_GAP if there is none."""
    x, y, tx, ty = line
    lengths[:] = 0
    for k in range(2 * (FLANK + REACH)):
        for side in range(-1, 2):
            away = (k / 2 - FLANK) * BIN
            row, col, j = _cell(line, away, side / scale, number, origin, scale)
            if j >= 0 and wall[row, col]:
                dx, dy = places[j, 0] - x, places[j, 1] - y
                along, across = dx * tx + dy * ty, dy * tx - dx * ty
                b = int(np.floor(along / BIN)) + FLANK
                if abs(across) < ON_LINE + LINE_ERROR * abs(along) and 0 <= b < len(lengths[0]):
                    lengths[1, b] = along if lengths[0, b] == 0 else max(lengths[1, b], along)
                    lengths[2, b] = along if lengths[0, b] == 0 else min(lengths[2, b], along)
                    lengths[0, b] = 1
    begin = FLANK
    while begin < FLANK + AHEAD and lengths[0, begin]:
        begin += 1
    if begin == FLANK + AHEAD or lengths[0, begin - FLANK : begin].sum() < MIN_FLANK:
        return NO_GAP, NO_GAP, 0.0
    stray, narrowest, widest = 0, int(MIN_WIDTH / BIN), int(MAX_WIDTH / BIN)
    for b in range(begin + 1, min(begin + widest + 1, REACH)):
        if lengths[0, b]:
            if b - begin >= narrowest and lengths[0, b : b + FLANK].sum() >= MIN_FAR_FLANK:
                last = begin - 1
                while not lengths[0, last]:
                    last -= 1
                far = _deviation(line, b - FLANK, b, wall, number, places, origin, scale)
                if far <= 2 * MAX_DEVIATION:
                    return lengths[1, last], lengths[2, b], far
                return NO_GAP, NO_GAP, 0.0
            stray += 1
            if stray > MAX_STRAY:
                return NO_GAP, NO_GAP, 0.0
    return NO_GAP, NO_GAP, 0.0
