"""The open leaves of the doors found.

No beam passes through an open leaf while the door is open, and it is not observed there while the
door is closed: static cells within the swing of a door's leaf are the leaf itself.
"""

from __future__ import annotations

import numpy as np

from slam.geometry import Array
from slam.grid import GridSpec
from slam.layers.classification import CHANGING, STATIC
from slam.layers.doors import JAMB_DEPTH, MappedDoor, in_gap
from slam.layers.regions import components

SWING_BESIDE, SWING_BEYOND = 0.3, 0.25  # m beside the gap and beyond its width, for an open leaf
JAMB_LENGTH = 0.12  # m from the gap's ends, where static cells may be the jamb
SWING_MARGIN = 0.5  # m around the swing: what extends beyond it is no leaf
MIN_LEAF_CELLS = 4  # of an open leaf, from which on they tell where its hinge is


def open_swings(kind: np.ndarray, spec: GridSpec, doors: list[MappedDoor]) -> list[MappedDoor]:
    """Set static cells that are the open leaf of a sure door that moved to CHANGING in `kind`:
    those in the gap, and connected components beside it that do not extend beyond the swing of the
    leaf. Returns the doors, with what the leaf tells of their hinges."""
    return [_swung(door, kind, spec) if door.sure else door for door in doors]


def _swung(door: MappedDoor, kind: np.ndarray, spec: GridSpec) -> MappedDoor:
    """The door with its hinge; if it moved, its open leaf is set to CHANGING in `kind`."""
    reach = door.width + SWING_BEYOND
    low = door.ends.min(axis=0) - reach - SWING_MARGIN
    high = door.ends.max(axis=0) + reach + SWING_MARGIN
    (row0, col0), (row1, col1) = np.maximum(spec.cells(np.array([low, high])), 0)
    part = kind[row0 : row1 + 1, col0 : col1 + 1]
    cells = np.argwhere(part == STATIC)
    points = spec.centres(cells + (row0, col0))
    leaf = _leaf(points, cells, part.shape, door)
    if door.moved:
        part[tuple(cells[leaf].T)] = CHANGING
    return _hinged(door, points[leaf])


def _hinged(door: MappedDoor, leaf: Array) -> MappedDoor:
    """The door with the hinge and the side to which it opens, by the points (n, 2) of its leaf."""
    along, across = in_gap(leaf, door.ends)
    stands = np.abs(across) > JAMB_DEPTH
    if stands.sum() < MIN_LEAF_CELLS:
        return door
    hinge = int(np.median(along[stands]) > door.width / 2)
    return door._replace(hinge=hinge, swing=int(np.sign(np.median(across[stands]))))


def _leaf(points: Array, cells: np.ndarray, shape: tuple[int, int], door: MappedDoor) -> np.ndarray:
    """(n,) bool, which cells (n, 2) of an array of `shape`, at `points` (n, 2), are a leaf."""
    along, across = in_gap(points, door.ends)
    across = np.abs(across)
    swing = (
        (along > -SWING_BESIDE)
        & (along < door.width + SWING_BESIDE)
        & (across <= door.width + SWING_BEYOND)
    )
    jamb = across <= JAMB_DEPTH
    gap = jamb & (along > JAMB_LENGTH) & (along < door.width - JAMB_LENGTH)
    loose = np.zeros(shape, np.bool_)
    loose[tuple(cells[~jamb].T)] = True
    labels, count = components(loose)
    component = labels[tuple(cells.T)]
    extends = np.bincount(component[~swing], minlength=count + 1) > 0
    return gap | (~jamb & ~extends[component])
