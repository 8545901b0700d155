"""FreeSpace: the area that is reachable when all doors are open, as polygons.

Walls are lines without thickness, which divide the plane into faces. The faces are traced along
their edges (de Berg et al., Computational Geometry, 3rd edition, ch. 2.2: the doubly-connected edge
list); the face that contains the robot is free. Polygons stay sharp at any zoom, unlike a flood
fill.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from slam.geometry import Array

WALL_EXTENSION = 0.005  # m, at both ends of a wall: gaps of twice as much are closed
CORNER_RESOLUTION = 1e-4  # m, closer corners are merged


class FreeSpace(NamedTuple):
    """A polygon with holes.

    outer  (n, 2) m, outer boundary; None: unbounded
    holes  (k, 2) m each, solids inside
    """

    outer: Array | None
    holes: list[Array]


def free_space(walls: Array, at: tuple[float, float]) -> FreeSpace:
    """The free space around `at`, m, among `walls` (w, 4), m."""
    corners, edges = _corners_and_edges(_pieces(_lengthened(walls)))
    rings = [corners[_without_spikes(ring)] for ring in _rings(corners, edges)]
    areas = [_area(ring) for ring in rings]
    around = [
        (area, i)
        for i, (area, ring) in enumerate(zip(areas, rings, strict=True))
        if area > 0 and _inside(at, ring)
    ]
    if not around:
        return FreeSpace(None, [r for a, r in zip(areas, rings, strict=True) if a < 0])
    outer = rings[min(around)[1]]
    holes = [r for a, r in zip(areas, rings, strict=True) if a < 0 and _within(r, outer)]
    return FreeSpace(outer, holes)


def _lengthened(walls: Array) -> Array:
    """(n, 2, 2) end points of the walls, extended at both ends so that corners intersect."""
    ends = walls.reshape(-1, 2, 2)
    along = ends[:, 1] - ends[:, 0]
    length = np.linalg.norm(along, axis=1)
    ends, along, length = (
        ends[length > CORNER_RESOLUTION],
        along[length > CORNER_RESOLUTION],
        length[length > CORNER_RESOLUTION],
    )
    more = along * (WALL_EXTENSION / length)[:, None]
    return np.stack([ends[:, 0] - more, ends[:, 1] + more], axis=1)


def _pieces(walls: Array) -> Array:
    """(m, 2, 2) the walls, cut wherever another wall crosses or touches them."""
    start, along = walls[:, 0], walls[:, 1] - walls[:, 0]
    between = start[None] - start[:, None]
    cross = _cross(along[:, None], along[None])
    with np.errstate(divide="ignore", invalid="ignore"):
        t = _cross(between, along[None]) / cross  # along the wall of the row
        u = _cross(between, along[:, None]) / cross
    crossing = (t >= 0) & (t <= 1) & (u >= 0) & (u <= 1)
    ends = walls.reshape(-1, 2)
    offset = ends[None] - start[:, None]
    length = np.linalg.norm(along, axis=1)[:, None]
    share = (offset @ along[:, :, None])[:, :, 0] / length**2
    beside = np.abs(_cross(offset, along[:, None])) / length
    touching = (beside < CORNER_RESOLUTION) & (share >= 0) & (share <= 1)
    pieces = []
    for i, (a, d) in enumerate(zip(start, along, strict=True)):
        cuts = np.concatenate([[0.0, 1.0], t[i, crossing[i]], share[i, touching[i]]])
        points = a + np.unique(cuts)[:, None] * d
        pieces.append(np.stack([points[:-1], points[1:]], axis=1))
    return np.concatenate(pieces) if pieces else np.empty((0, 2, 2))


def _corners_and_edges(pieces: Array) -> tuple[Array, np.ndarray]:
    """(c, 2) corners, m, and (e, 2) the indices of each edge's corners, in both directions."""
    lattice = np.round(pieces.reshape(-1, 2) / CORNER_RESOLUTION).astype(np.int64)
    corners, ids = np.unique(lattice, axis=0, return_inverse=True)
    edges = ids.reshape(-1, 2)
    edges = edges[edges[:, 0] != edges[:, 1]]
    edges = np.unique(np.concatenate([edges, edges[:, ::-1]]), axis=0)
    return corners.astype(np.float64) * CORNER_RESOLUTION, edges


def _rings(corners: Array, edges: np.ndarray) -> list[list[int]]:
    """The corners around each face, with the face on the left."""
    headings = np.arctan2(*(corners[edges[:, 1]] - corners[edges[:, 0]]).T[::-1])
    order = np.lexsort([headings, edges[:, 0]])  # around every corner, counter-clockwise
    leaving: dict[int, list[int]] = {}
    for a, b in edges[order].tolist():
        leaving.setdefault(a, []).append(b)
    clockwise = {
        (a, b): around[i - 1] for a, around in leaving.items() for i, b in enumerate(around)
    }
    left = set(clockwise)
    rings = []
    while left:
        a, b = left.pop()
        ring = [a]
        first = a, b
        while (step := (b, clockwise[b, a])) != first:
            left.remove(step)
            a, b = step
            ring.append(a)
        rings.append(ring)
    return rings


def _without_spikes(ring: list[int]) -> list[int]:
    """The ring without dead-end walls, which it traverses in both directions."""
    kept: list[int] = []
    for corner in ring:
        if len(kept) > 1 and kept[-2] == corner:
            kept.pop()
        else:
            kept.append(corner)
    while len(kept) > 2 and kept[1] == kept[-1]:  # a spike at the start of the ring
        kept = kept[1:-1]
    return kept


def _cross(a: Array, b: Array) -> Array:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _area(ring: Array) -> float:
    """Area in m^2, negative for a clockwise ring: the outside of a solid."""
    return float(_cross(ring, np.roll(ring, -1, axis=0)).sum()) / 2


def _inside(point: tuple[float, float], ring: Array) -> bool:
    """Even-odd rule; edges that occur in both directions cancel."""
    (x, y), a, b = point, ring, np.roll(ring, -1, axis=0)
    spans = (a[:, 1] > y) != (b[:, 1] > y)
    (ax, ay), (bx, by) = a[spans].T, b[spans].T
    return bool(np.count_nonzero(ax + (y - ay) / (by - ay) * (bx - ax) > x) % 2)


def _within(ring: Array, outer: Array) -> bool:
    """Whether a clockwise ring is inside `outer`, judged by its leftmost corner."""
    x, y = ring[np.lexsort(ring.T[::-1])[0]].tolist()
    return not (outer == (x, y)).all(axis=1).any() and _inside((x, y), outer)
