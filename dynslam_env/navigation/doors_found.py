"""Doors found: clusters of cells that were seen to change."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dynslam_env.navigation.beliefs import Beliefs
from dynslam_env.navigation.regions import loose_clusters
from slam.geometry import Array

FEWEST = 3  # cells
WIDEST = 1.2  # m from the centre: what changes over more than that is no one door
SEEN_SHARE = 0.3  # of its cells: a door counts as seen when so many were; a leaf hides the others


class FoundDoor(NamedTuple):
    """Something that was seen to change where it stands: a door, most likely.

    centre  (2,) m
    reach   m, from the centre to its farthest cell
    age     s since it was last seen
    flips   1/s, mean over its cells of the observed changes of state
    cells   of the beliefs, so many
    """

    centre: Array
    reach: float
    age: float
    flips: float
    cells: int


def doors_found(beliefs: Beliefs, fewest: int = FEWEST) -> list[FoundDoor]:
    """Clusters of at least `fewest` changing cells with no gap between them wider than two cells.

    What is too wide for one door, such as where people walk, is left out.
    """
    found = [_door(beliefs, cells) for cells in loose_clusters(beliefs.flips > 0, fewest)]
    return [door for door in found if door.reach <= WIDEST]


def _door(beliefs: Beliefs, cells: NDArray[np.int64]) -> FoundDoor:
    points = beliefs.spec.centres(cells)
    centre = points.mean(axis=0)
    rows, cols = cells.T
    return FoundDoor(
        centre,
        float(np.hypot(*(points - centre).T).max()),
        float(np.quantile(beliefs.age[rows, cols], SEEN_SHARE)),
        float(beliefs.flips[rows, cols].mean()),
        len(cells),
    )
