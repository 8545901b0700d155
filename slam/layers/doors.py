"""Detection of doors in the layers of a map.

A gap of a door's width in a straight wall is a door if it was seen open and closed, if a leaf that
is set back from the face of the wall stands in it, or if an open leaf stands beside it.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from slam.geometry import Array
from slam.grid import GridSpec
from slam.layers.classification import KEPT, STATIC
from slam.layers.door_looks import Looks, Views, look
from slam.layers.door_probability import Evidence, evidence, probability
from slam.layers.gap_shape import shape_of
from slam.layers.surface import SurfaceCells
from slam.layers.wall_gaps import find_wall_gaps

LEAF_DEPTH = 0.1  # m to either side of the gap in which the closed leaf's cells lie
JAMB_DEPTH = 0.2  # m to either side of the gap, of the jamb
SAME_DOOR = 0.35  # m between the middles of two gaps that are one
SURE, PERHAPS = 0.9, 0.5  # probabilities from which on a gap is called a door, or is listed


class MappedDoor(NamedTuple):
    """A door, seen open and closed or told by its shape.

    ends         (2, 2) m, map frame: the ends of the closed leaf, or of the gap
    open_share   share of the watched time in which it was open
    flips        number of observed changes; 0: it did not move in sight
    watched      s, without the times between distant looks
    first, last  s from the first scan to the first and last look
    seen_open    scans that saw through it; seen_closed: that saw it closed
    probability  that it is a door
    hinge        0 or 1, at which of the ends the open leaf was seen; -1: it was not, or it slides
    swing        1 if it opens to the left of the way from the first end to the second, -1 to the
                 right, 0 if it was not seen
    """

    ends: Array
    open_share: float
    flips: int
    watched: float
    first: float
    last: float
    seen_open: int
    seen_closed: int
    probability: float
    hinge: int = -1
    swing: int = 0

    @property
    def sure(self) -> bool:
        """Whether it is so probable that it is called a door."""
        return self.probability >= SURE

    @property
    def moved(self) -> bool:
        """Whether it was seen to open or to close: several looks in a row of one state, then of the
        other."""
        return self.flips > 0

    @property
    def open_probability(self) -> float:
        """That it is open at some other time. Each time that it was in one state counts as one
        look, beside one at an open and one at a closed door (Laplace's rule of succession): a door
        that was seen closed and did not move may well be open another time, here with 1/3."""
        looks = self.flips + 1 if self.seen_open + self.seen_closed else 0
        return (looks * self.open_share + 1) / (looks + 2)

    @property
    def middle(self) -> Array:
        """(2,) m, map frame."""
        return self.ends.mean(axis=0)

    @property
    def width(self) -> float:
        """m, between the static cells on either side."""
        return float(np.hypot(*(self.ends[1] - self.ends[0])))

    @property
    def per_hour(self) -> float:
        """Flips per watched hour."""
        return 3600.0 * self.flips / self.watched if self.watched else 0.0

    @property
    def outline(self) -> Array:
        """(4, 2) m, map frame, counter-clockwise: the gap as a rectangle LEAF_DEPTH deep."""
        line = (self.ends[1] - self.ends[0]) / self.width
        across = LEAF_DEPTH / 2 * np.array([-line[1], line[0]])
        a, b = self.ends
        return np.array([a - across, b - across, b + across, a + across])


class Candidate(NamedTuple):
    """A gap that may be a door.

    ends   (2, 2) m, map frame, of its leaf
    looks  what scans saw of it
    told   the evidence
    """

    ends: Array
    looks: Looks
    told: Evidence


def find_doors(
    views: Views, kind: np.ndarray, went: np.ndarray, spec: GridSpec, surface: SurfaceCells
) -> list[MappedDoor]:
    """The doors in a map, by decreasing probability, from PERHAPS on: see `candidates`. Of those at
    the same place the most probable."""
    doors = [_door(one) for one in candidates(views, kind, went, spec, surface)]
    listed = [door for door in doors if door.probability >= PERHAPS]
    return each_once(listed, SAME_DOOR)


def each_once(doors: Iterable[MappedDoor], apart: float) -> list[MappedDoor]:
    """By decreasing probability, the doors without those that have their middle within `apart`, m,
    of that of a more probable one."""
    kept: list[MappedDoor] = []
    for door in sorted(doors, key=lambda door: -door.probability):
        away = [np.hypot(*(door.middle - one.middle)) for one in kept]
        if min(away, default=np.inf) > apart:
            kept.append(door)
    return kept


def candidates(
    views: Views, kind: np.ndarray, went: np.ndarray, spec: GridSpec, surface: SurfaceCells
) -> list[Candidate]:
    """All gaps of a door's width in walls that are straight, or nearly so if it was seen to move.

    kind  (rows, cols) classes of the cells; what is KEPT belongs to walls: glass
    went  (rows, cols) bool, cells whose content was seen to go
    """
    wall = np.isin(kind, (STATIC, KEPT)) & ~went
    gaps = find_wall_gaps(wall, spec, surface)
    if not gaps:
        return []
    shaped = [shape_of(gap.ends, kind, wall, spec, surface) for gap in gaps]
    looks = look(views, np.array([line for _, line in shaped] + [gap.ends for gap in gaps]))
    found = []
    for k, ((ends, straight), (shape, line)) in enumerate(zip(gaps, shaped, strict=True)):
        seen = looks[k]
        if not seen.closed:  # what was seen in the gap is no leaf: people walked by
            seen, line = looks[len(gaps) + k], ends
        if not straight and not seen.flips:
            continue
        width = float(np.hypot(*(ends[1] - ends[0])))
        found.append(Candidate(line, seen, evidence(width, shape, seen)))
    return found


def _door(gap: Candidate) -> MappedDoor:
    seen = gap.looks
    return MappedDoor(gap.ends, seen.open_share, seen.flips, seen.watched, seen.first, seen.last,
                      seen.opened, seen.closed, probability(gap.told))  # fmt: skip


def in_closed_leaves(points: Array, doors: list[MappedDoor]) -> np.ndarray:
    """(n,) bool: which points (n, 2), m, lie on the closed leaf of a door that moved."""
    result = np.zeros(len(points), np.bool_)
    for door in filter(lambda door: door.moved, doors):
        along, across = in_gap(points, door.ends)
        result |= (along > 0) & (along < door.width) & (np.abs(across) < LEAF_DEPTH)
    return result


def in_gap(points: Array, ends: Array) -> tuple[Array, Array]:
    """(n,) m along a gap from its first end, and (n,) m from its line, positive to the left, of
    `points` (n, 2)."""
    line = ends[1] - ends[0]
    line = line / np.hypot(*line)
    away = points - ends[0]
    return away @ line, away @ np.array([-line[1], line[0]])
