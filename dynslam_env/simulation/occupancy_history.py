"""OccupancyHistory: the true occupancy grid of an episode, now and over time."""

from __future__ import annotations

import copy
from collections.abc import Callable

import numpy as np

from slam.episode import Truth
from slam.geometry import Array
from slam.metrics.change import TrueOccupancy
from slam.validation import positive_number

DEFAULT_CELL = 0.05  # m, side of a cell
STATES_PER_BATCH = 256  # states whose outlines are computed at once


class OccupancyHistory:
    """Stores the state of every step, and rasterises the states on request.

    walls     (w, 4) segments, m, that never move
    outlines  maps states (t, ...) of t steps to the edges (t, e, 4), m, of all movable solids
    """

    def __init__(self, walls: Array, outlines: Callable[[Array], Array]):
        self._walls, self._outlines = walls, outlines
        self._states: list[Array] = []
        self._rasters: dict[float, tuple[int, TrueOccupancy]] = {}

    def add(self, state: Array) -> None:
        """Add the state of a step; the array is kept, not copied."""
        self._states.append(state)

    def occupancy(self, cell: float) -> TrueOccupancy:
        """The share of the steps so far in which each cell was occupied, and the current grid.

        cell  side of a cell, m
        """
        positive_number("cell", cell)
        done, raster = self._rasters.get(cell, (0, None))
        for start in range(done, len(self._states), STATES_PER_BATCH):
            edges = self._outlines(np.array(self._states[start : start + STATES_PER_BATCH]))
            if raster is None:
                raster = TrueOccupancy(Truth(np.empty((0, 3)), self._walls, edges), cell)
            else:
                raster.add(edges)
        assert raster is not None  # an episode has a first state
        self._rasters[cell] = len(self._states), raster
        return copy.copy(raster)  # later states replace its arrays and do not change them
