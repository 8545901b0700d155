"""The shape of a gap in a wall: what stands in it, before it, behind it and beside it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from slam.geometry import Array
from slam.grid import GridSpec
from slam.kernel import kernel
from slam.layers.classification import CHANGING, FREE
from slam.layers.surface import SurfaceCells

LENGTH = 0.05  # m, of the parts of a gap of which it is asked whether something stands in them
FLANK = 0.05, 0.55  # m from a gap's end, of the wall beside it
ON_WALL = 0.04  # m of the wall's cells from its line
NEAR, FAR = 0.1, 0.5  # m before and behind a gap, of the areas that are free or not
JAMB = 0.05  # m from the gap's ends, where cells are of the jamb
THICK = 0.025  # m from a leaf's line, of its cells
BLOCKED = 0.3  # m to either side of the gap's line, in which what stands blocks it
OFFSETS = np.arange(-0.25, 0.26, 0.01)  # m behind the wall's face, where a closed leaf may be
MIN_COVER = 0.3  # of the width, that a leaf covers
ANGLES = np.radians(np.arange(50.0, 121.0, 10.0))  # of an open leaf with the gap
HINGES = 0.0, 0.08, 0.16  # m of a hinge behind the face of the wall
LEAF_THICK = 0.05  # m from an open leaf's line, of its cells
LEAF_FROM, LEAF_TO = 0.1, 0.08  # m from the hinge, and from the leaf's end, that are looked at
BEYOND, MANY_BEYOND = (0.1, 0.4), 6  # m beyond a leaf's end, and cells there: it is a wall


class GapShape(NamedTuple):
    """What stands in and around a gap.

    flank     share of the wall beside it that lies in one line, on the side with less of it
    front     share of the area before it that was seen to be free, beyond: behind it
    cover     share of its width over which one straight leaf stands, or stood; depth: m from the
              wall's face to it, positive away from the front
    blocked   share of its width in which anything always stood
    leaf      share of a leaf's length that stands beside an end of it, and does not go on
    """

    flank: float
    front: float
    beyond: float
    cover: float
    depth: float
    blocked: float
    leaf: float


def shape_of(
    ends: Array, kind: np.ndarray, wall: np.ndarray, spec: GridSpec, surface: SurfaceCells
) -> tuple[GapShape, Array]:
    """The shape of a gap (2, 2), m, and the line (2, 2), m, of what was seen in it: of its leaf.

    kind  (rows, cols) classes of the cells
    wall  (rows, cols) bool, cells that always stood
    """
    width = float(np.hypot(*(ends[1] - ends[0])))
    line = (ends[1] - ends[0]) / width
    left, right = (_free(ends, kind, spec, side) for side in (1, -1))
    back = -1.0 if left >= right else 1.0  # the side of the gap's line away from the front
    normal = back * np.array([-line[1], line[0]])
    close = (np.abs(surface.places - ends.mean(axis=0)) < 1.5 * width + FLANK[1]).all(axis=1)
    places, stands = surface.places[close] - ends[0], wall[tuple(surface.cells[close].T)]
    echoes = surface.echoes[close]
    along, across = places @ line, places @ normal
    solid = np.column_stack([along, across])[stands]
    inside = (along > JAMB) & (along < width - JAMB) & (np.abs(across) < BLOCKED)
    cover, depth = _closed_leaf(along[inside], across[inside], echoes[inside], width)
    inner = stands & inside
    shape = GapShape(
        min(_flank(solid, width, end) for end in (0, 1)), max(left, right), min(left, right), cover,
        depth, _covered(along[inner], JAMB, width - JAMB), _open_leaf(solid, width),
    )  # fmt: skip
    return shape, ends + depth * normal


@kernel(error_model="numpy")
def _covered(along, begin, end):
    """Share of the LENGTHs from `begin` to `end`, m, in which there is one of `along` (n,)."""
    parts = max(round((end - begin) / LENGTH), 1)
    there = np.zeros(parts, np.bool_)
    for one in along:
        part = np.floor((one - begin) / (end - begin) * parts)
        if 0 <= part < parts:
            there[int(part)] = True
    return there.sum() / parts


def _flank(solid: Array, width: float, end: int) -> float:
    """Share of the wall beyond an end of a gap; `solid` (n, 2) lies along and across."""
    away = solid[:, 0] - width if end else -solid[:, 0]
    return _covered(away[np.abs(solid[:, 1]) < ON_WALL], *FLANK)


def _free(ends: Array, kind: np.ndarray, spec: GridSpec, side: int) -> float:
    """Share of the area on one side of a gap that beams crossed, or in which something changes."""
    width = np.hypot(*(ends[1] - ends[0]))
    line = (ends[1] - ends[0]) / width
    along = np.arange(NEAR, width - NEAR, spec.resolution)
    away = np.arange(NEAR, FAR, spec.resolution)
    points = ends[0] + along[:, None, None] * line
    points = points + side * away[:, None] * np.array([-line[1], line[0]])
    cells = spec.cells(points.reshape(-1, 2))
    inside = ((cells >= 0) & (cells < spec.shape)).all(axis=1)
    return float(np.isin(kind[tuple(cells[inside].T)], (FREE, CHANGING)).sum() / len(cells))


def _closed_leaf(
    along: Array, across: Array, echoes: np.ndarray, width: float
) -> tuple[float, float]:
    """How much of the width the straight leaf covers that covers most, and m to it from the line of
    the gap: its mean; 0 if nothing was seen in the gap."""
    best, depth = 0.0, 0.0
    for offset in OFFSETS:
        on = np.abs(across - offset) < THICK
        share = _covered(along[on], JAMB, width - JAMB)
        if share > best + 1e-9:
            best, depth = share, float(np.average(across[on], weights=echoes[on]))
    return (best, depth) if best >= MIN_COVER else (0.0, 0.0)


@kernel(error_model="numpy")
def _open_leaf(solid, width):
    """Share of an open leaf that stands at one of the ends, at the angle at which there is most; a
    wall that goes on beyond a leaf's length is none."""
    best, on = 0.0, np.empty(len(solid))
    for end, inward in ((0.0, 1.0), (width, -1.0)):
        for side in (1.0, -1.0):
            for hinge in HINGES:
                x, y = end + 0.03 * inward, side * hinge
                for angle in ANGLES:
                    c, s = inward * np.cos(angle), side * np.sin(angle)
                    n, more = 0, 0
                    for k in range(len(solid)):
                        dx, dy = solid[k, 0] - x, solid[k, 1] - y
                        if abs(c * dy - s * dx) < LEAF_THICK:
                            on[n] = c * dx + s * dy
                            more += width + BEYOND[0] < on[n] < width + BEYOND[1]
                            n += 1
                    share = _covered(on[:n], LEAF_FROM, width - LEAF_TO)
                    best = max(best, share * (1.0 - min(more / MANY_BEYOND, 1.0)))
    return best
