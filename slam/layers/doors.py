"""Doors found, and what hangs on them.

A closed leaf is a straight line of cells that change, between two cells that always stand, as long
as a door is wide. An open one hangs on one end only, and what people leave behind hardly ever
fills a gap. Beside a door nothing always stands within the swing of its leaf: what seemed to is
the leaf at rest, which no beam goes through while the door is open, and which nobody sees while it
is closed.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from slam.geometry import Array
from slam.grid import GridSpec
from slam.layers.gaps import CLEAR, NARROWEST, WIDEST, find_gaps
from slam.layers.kinds import CHANGING, STATIC, pieces
from slam.layers.looks import Looks
from slam.layers.surface import SurfaceCells

BOTH = 0.4  # s that a cell was watched in each state, to be a leaf's
HELD = 0.6  # s that a door was watched in each state: walls flicker for less
CAP = 3.0  # s watched as occupied that a cell counts for at most
THICK = 0.1  # m to either side of the gap in which the closed leaf's cells lie
BEFORE, BLOCKED = 0.3, 0.15  # m before a door, and share of that where something may stand
JAMB = 0.2  # m to either side of the gap, where a jamb may be
BESIDE, BEYOND = 0.3, 0.25  # m: so far beside the gap, and beyond its width, a leaf may rest
AROUND = 0.5  # m around the swing: what goes on there is no leaf


class MappedDoor(NamedTuple):
    """A door that was seen open and closed.

    ends         (2, 2) m, map frame: where the closed leaf begins and ends
    open_share   share of the watched time in which the leaf's place was free
    flips        changes that were seen
    watched      s, without the times when nobody looked
    first, last  s since the first scan: when it was first and last looked at
    confidence   share of the gap that was seen to change, times flips / (flips + 1)

    The first three figures are medians of the cells.
    """

    ends: Array
    open_share: float
    flips: int
    watched: float
    first: float
    last: float
    confidence: float

    @property
    def width(self) -> float:
        """m, between what stands on either side."""
        return float(np.hypot(*(self.ends[1] - self.ends[0])))

    @property
    def per_hour(self) -> float:
        """Flips for every hour that it was watched."""
        return 3600.0 * self.flips / self.watched

    @property
    def outline(self) -> Array:
        """(4, 2) m, map frame, counter-clockwise: the gap as a rectangle of the cells' depth."""
        line = (self.ends[1] - self.ends[0]) / self.width
        across = THICK / 2 * np.array([-line[1], line[0]])
        a, b = self.ends
        return np.array([a - across, b - across, b + across, a + across])


def find_doors(
    kind: np.ndarray, spec: GridSpec, surface: SurfaceCells, looks: Looks
) -> list[MappedDoor]:
    """The doors in a map of `kind` (rows, cols), the surest first."""
    moves = kind[tuple(surface.cells.T)] == CHANGING
    moves &= np.minimum(looks.free_for, looks.occupied_for) >= BOTH
    leaf = np.zeros(spec.shape, np.float32)
    leaf[tuple(surface.cells[moves].T)] = np.minimum(looks.occupied_for[moves], CAP)
    gaps = [_straight(ends, moves, surface) for ends in find_gaps(kind, leaf, spec)]
    doors = [_door(ends, moves, surface, looks, spec.resolution) for ends in gaps]
    sure = [door for door in doors if door is not None and _leads(door, kind, spec)]
    return sorted(sure, key=lambda door: -door.confidence)


def open_swings(kind: np.ndarray, spec: GridSpec, doors: list[MappedDoor]) -> None:
    """Change the `kind` of what seems to stand within the swing of a leaf, for it is the leaf: all
    in the gap, and what hangs beside the gap and reaches no farther than the leaf does."""
    for door in doors:
        reach = door.width + BEYOND
        low = door.ends.min(axis=0) - reach - AROUND
        high = door.ends.max(axis=0) + reach + AROUND
        (row0, col0), (row1, col1) = np.maximum(spec.cells(np.array([low, high])), 0)
        part = kind[row0 : row1 + 1, col0 : col1 + 1]
        cells = np.argwhere(part == STATIC)
        leaf = _leaf(spec.centres(cells + (row0, col0)), cells, part.shape, door)
        part[tuple(cells[leaf].T)] = CHANGING


def _leaf(points: Array, cells: np.ndarray, shape: tuple[int, int], door: MappedDoor) -> np.ndarray:
    """(n,) bool: which of the cells (n, 2) of an array of `shape`, at points (n, 2), are a leaf."""
    along, across = _in_gap(points, door.ends)
    swing = (along > -BESIDE) & (along < door.width + BESIDE) & (across <= door.width + BEYOND)
    jamb = across <= JAMB
    gap = jamb & (along > CLEAR) & (along < door.width - CLEAR)
    loose = np.zeros(shape, np.bool_)
    loose[tuple(cells[~jamb].T)] = True
    labels, count = pieces(loose)
    piece = labels[tuple(cells.T)]
    goes_on = np.bincount(piece[~swing], minlength=count + 1) > 0
    return gap | (~jamb & ~goes_on[piece])


def _straight(ends: Array, moves: np.ndarray, surface: SurfaceCells) -> Array:
    """The gap's ends, on the line that most of the leaf's echoes lie on."""
    along, across = _in_gap(surface.places, ends)
    width = np.hypot(*(ends[1] - ends[0]))
    on = moves & (along > 0) & (along < width) & (across < JAMB)
    if on.sum() < 3:
        return ends
    weights = surface.echoes[on].astype(np.float64) ** 2  # a closed leaf's cells have the most
    mean = np.average(surface.places[on], axis=0, weights=weights)
    _, axes = np.linalg.eigh(np.cov(surface.places[on].T, aweights=weights))
    line = axes[:, 1]
    return mean + ((ends - mean) @ line)[:, None] * line


def _door(
    ends: Array, moves: np.ndarray, surface: SurfaceCells, looks: Looks, resolution: float
) -> MappedDoor | None:
    """What is known of the door in a gap; None where it was hardly watched in one of its states."""
    along, across = _in_gap(surface.places, ends)
    width = float(np.hypot(*(ends[1] - ends[0])))
    on = np.flatnonzero(moves & (along > 0) & (along < width) & (across < THICK))
    if not len(on) or not NARROWEST <= width <= 1.2 * WIDEST:
        return None
    free, occupied = looks.free_for[on], looks.occupied_for[on]
    watched, share = float(np.median(free + occupied)), float(np.median(free / (free + occupied)))
    if min(share, 1 - share) * watched < HELD:
        return None
    flips = max(int(np.median(looks.flips[on])), 1)
    steps = np.unique((along[on] / resolution).astype(np.int64))
    filled = min(len(steps) * resolution / width, 1.0)
    first, last = float(looks.first[on].min()), float(looks.last[on].max())
    return MappedDoor(ends, share, flips, watched, first, last, filled * flips / (flips + 1))


def _leads(door: MappedDoor, kind: np.ndarray, spec: GridSpec) -> bool:
    """Whether somebody could walk through: hardly anything stands before and behind the middle of
    the gap, where a wall goes on that only flickers."""
    line = (door.ends[1] - door.ends[0]) / door.width
    out, step = np.array([-line[1], line[0]]), spec.resolution
    along = np.arange(-door.width / 4, door.width / 4, step)
    away = np.arange(step, BEFORE + step / 2, step)
    for side in (out, -out):
        points = door.ends.mean(axis=0) + along[:, None, None] * line + away[:, None] * side
        rows, cols = spec.cells(points.reshape(-1, 2)).T
        inside = (rows >= 0) & (rows < spec.rows) & (cols >= 0) & (cols < spec.cols)
        if (kind[rows[inside], cols[inside]] == STATIC).sum() > BLOCKED * len(rows):
            return False
    return True


def _in_gap(points: Array, ends: Array) -> tuple[Array, Array]:
    """m along a gap from its first end, and m across it, to either side, of points (n, 2)."""
    line = ends[1] - ends[0]
    line = line / np.hypot(*line)
    away = points - ends[0]
    return away @ line, np.abs(away @ np.array([-line[1], line[0]]))
