"""Doors found: clusters of cells whose state was observed to change."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dynslam_env.navigation.beliefs import Beliefs
from dynslam_env.navigation.regions import loose_clusters
from slam.geometry import Array

MIN_DOOR_CELLS = 3
MAX_DOOR_RADIUS = 1.2  # m: a larger cluster is not one door
AGE_QUANTILE = 0.3  # quantile of the cells' ages taken as the door's: an open leaf hides some cells


class FoundDoor(NamedTuple):
    """A cluster of changing cells: most likely a door.

    centre  (2,) m
    radius  m, from the centre to the farthest cell
    age     s since it was last seen
    flips   1/s, observed changes of state, mean over the cells
    cells   number of cells of the beliefs
    """

    centre: Array
    radius: float
    age: float
    flips: float
    cells: int


def doors_found(beliefs: Beliefs, min_cells: int = MIN_DOOR_CELLS) -> list[FoundDoor]:
    """Clusters of at least `min_cells` changing cells, gaps of up to two cells allowed.

    Clusters too large for one door, such as where people walk, are left out.
    """
    found = [_door(beliefs, cells) for cells in loose_clusters(beliefs.flips > 0, min_cells)]
    return [door for door in found if door.radius <= MAX_DOOR_RADIUS]


def _door(beliefs: Beliefs, cells: NDArray[np.int64]) -> FoundDoor:
    points = beliefs.spec.centres(cells)
    centre = points.mean(axis=0)
    rows, cols = cells.T
    return FoundDoor(
        centre,
        float(np.hypot(*(points - centre).T).max()),
        float(np.quantile(beliefs.age[rows, cols], AGE_QUANTILE)),
        float(beliefs.flips[rows, cols].mean()),
        len(cells),
    )
