"""Detection of doors in the layers of a map.

A closed leaf is a straight line of changing cells between two static cells, as long as a door is
wide. An open leaf touches one end of the gap only, and traces of people hardly ever fill a gap.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from slam.geometry import Array
from slam.grid import GridSpec
from slam.layers.cell_statistics import CellStatistics
from slam.layers.classification import CHANGING, STATIC
from slam.layers.door_probability import Evidence, flatness, probability, walls_beside
from slam.layers.gaps import MAX_DOOR_WIDTH, MIN_DOOR_WIDTH, find_gaps
from slam.layers.surface import SurfaceCells

MIN_CELL_TIME = 0.4  # s watched in each state, of a cell of a leaf
MIN_DOOR_TIME = 0.6  # s watched in each state, of a door: walls flicker for less
MAX_CELL_TIME = 3.0  # s watched as occupied, up to which a cell counts
LEAF_DEPTH = 0.1  # m to either side of the gap in which the closed leaf's cells lie
APPROACH, MAX_BLOCKED_SHARE = 0.3, 0.15  # m before a door, and share of it that may be static
JAMB_DEPTH = 0.2  # m to either side of the gap, of the jamb
SURE, PERHAPS = 0.9, 0.5  # probabilities from which on a gap is called a door, or is listed


class MappedDoor(NamedTuple):
    """A door that was observed open and closed.

    ends         (2, 2) m, map frame: the ends of the closed leaf
    open_share   share of the watched time in which the closed leaf's cells were free
    flips        number of observed changes
    watched      s, without the times between distant observations
    first, last  s from the first scan to the first and last observation
    seen_open    scans that saw through its leaf; seen_closed: that saw it closed
    probability  that it is a door
    hinge        0 or 1, at which of the ends the open leaf was seen; -1: it was not, or it slides
    swing        1 if it opens to the left of the way from the first end to the second, -1 to the
                 right, 0 if it was not seen

    open_share, flips, watched and the numbers of scans are medians over the cells.
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
    def width(self) -> float:
        """m, between the static cells on either side."""
        return float(np.hypot(*(self.ends[1] - self.ends[0])))

    @property
    def per_hour(self) -> float:
        """Flips per watched hour."""
        return 3600.0 * self.flips / self.watched

    @property
    def outline(self) -> Array:
        """(4, 2) m, map frame, counter-clockwise: the gap as a rectangle LEAF_DEPTH deep."""
        line = (self.ends[1] - self.ends[0]) / self.width
        across = LEAF_DEPTH / 2 * np.array([-line[1], line[0]])
        a, b = self.ends
        return np.array([a - across, b - across, b + across, a + across])


def find_doors(
    kind: np.ndarray,
    spec: GridSpec,
    surface: SurfaceCells,
    statistics: CellStatistics,
    went: np.ndarray,
) -> list[MappedDoor]:
    """The doors in a map of classes `kind` (rows, cols), by decreasing probability, from PERHAPS
    on.

    went  (n,) bool, surface cells whose content was seen to go
    """
    changing = kind[tuple(surface.cells.T)] == CHANGING
    changing &= np.minimum(statistics.free_for, statistics.occupied_for) >= MIN_CELL_TIME
    leaf = np.zeros(spec.shape, np.float32)
    leaf[tuple(surface.cells[changing].T)] = np.minimum(
        statistics.occupied_for[changing], MAX_CELL_TIME
    )
    gaps = [_straight(ends, changing, surface) for ends in find_gaps(kind, leaf, spec)]
    doors = [_door(ends, changing, surface, statistics, went, kind, spec) for ends in gaps]
    found = [door for door in doors if door is not None and _passable(door, kind, spec)]
    listed = [door for door in found if door.probability >= PERHAPS]
    return sorted(listed, key=lambda door: -door.probability)


def in_closed_leaves(points: Array, doors: list[MappedDoor]) -> np.ndarray:
    """(n,) bool: which points (n, 2), m, lie on the closed leaf of a door."""
    result = np.zeros(len(points), np.bool_)
    for door in doors:
        along, across = in_gap(points, door.ends)
        result |= (along > 0) & (along < door.width) & (np.abs(across) < LEAF_DEPTH)
    return result


def _straight(ends: Array, changing: np.ndarray, surface: SurfaceCells) -> Array:
    """The gap's ends, projected on the line fitted to the leaf's echoes."""
    along, across = in_gap(surface.places, ends)
    width = np.hypot(*(ends[1] - ends[0]))
    on = changing & (along > 0) & (along < width) & (np.abs(across) < JAMB_DEPTH)
    if on.sum() < 3:
        return ends
    weights = surface.echoes[on].astype(np.float64) ** 2  # a closed leaf's cells have the most
    mean = np.average(surface.places[on], axis=0, weights=weights)
    _, axes = np.linalg.eigh(np.cov(surface.places[on].T, aweights=weights))
    line = axes[:, 1]
    return mean + ((ends - mean) @ line)[:, None] * line


def _door(
    ends: Array,
    changing: np.ndarray,
    surface: SurfaceCells,
    statistics: CellStatistics,
    went: np.ndarray,
    kind: np.ndarray,
    spec: GridSpec,
) -> MappedDoor | None:
    """The door in a gap; None if it was hardly watched in one of its states."""
    along, across = in_gap(surface.places, ends)
    width = float(np.hypot(*(ends[1] - ends[0])))
    leaf = (along > 0) & (along < width) & (np.abs(across) < LEAF_DEPTH)
    on = np.flatnonzero(changing & leaf)
    if not len(on) or not MIN_DOOR_WIDTH <= width <= 1.2 * MAX_DOOR_WIDTH:
        return None
    free, occupied = statistics.free_for[on], statistics.occupied_for[on]
    watched, share = float(np.median(free + occupied)), float(np.median(free / (free + occupied)))
    if min(share, 1 - share) * watched < MIN_DOOR_TIME:
        return None
    flips = max(int(np.median(statistics.flips[on])), 1)
    flat = flatness(across[on], surface.echoes[on])
    walls, gone = walls_beside(ends, kind, spec), float(went[on].mean())
    seen = Evidence(walls, flat, gone)
    first, last = float(statistics.first[on].min()), float(statistics.last[on].max())
    scans = int(np.median(statistics.passes[on])), int(np.median(statistics.hits[on]))
    return MappedDoor(ends, share, flips, watched, first, last, *scans, probability(seen))


def _passable(door: MappedDoor, kind: np.ndarray, spec: GridSpec) -> bool:
    """Whether one can walk through: hardly any cell before and behind the middle of the gap is
    static. In a wall that only flickers, many are."""
    line = (door.ends[1] - door.ends[0]) / door.width
    out, step = np.array([-line[1], line[0]]), spec.resolution
    along = np.arange(-door.width / 4, door.width / 4, step)
    away = np.arange(step, APPROACH + step / 2, step)
    for side in (out, -out):
        points = door.ends.mean(axis=0) + along[:, None, None] * line + away[:, None] * side
        rows, cols = spec.cells(points.reshape(-1, 2)).T
        inside = (rows >= 0) & (rows < spec.rows) & (cols >= 0) & (cols < spec.cols)
        if (kind[rows[inside], cols[inside]] == STATIC).sum() > MAX_BLOCKED_SHARE * len(rows):
            return False
    return True


def in_gap(points: Array, ends: Array) -> tuple[Array, Array]:
    """(n,) m along a gap from its first end, and (n,) m from its line, positive to the left, of
    `points` (n, 2)."""
    line = ends[1] - ends[0]
    line = line / np.hypot(*line)
    away = points - ends[0]
    return away @ line, away @ np.array([-line[1], line[0]])
