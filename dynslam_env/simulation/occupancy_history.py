"""OccupancyHistory: what has stood where since an episode began, as cells."""

from __future__ import annotations

import copy
from collections.abc import Callable

import numpy as np

from slam.episode import Truth
from slam.geometry import Array
from slam.metrics.change import TrueOccupancy
from slam.validation import positive_number

CELL = 0.05  # m, of maps unless asked otherwise
CHUNK = 256  # moments that are made outlines of at once


class OccupancyHistory:
    """Takes down every moment, and makes rasters of them when asked: until then it is cheap.

    walls     (w, 4) segments, m, that never move
    outlines  makes of states (t, ...) at t moments the edges (t, e, 4), m, of all that can move
    """

    def __init__(self, walls: Array, outlines: Callable[[Array], Array]):
        self._walls, self._outlines = walls, outlines
        self._states: list[Array] = []
        self._rasters: dict[float, tuple[int, TrueOccupancy]] = {}

    def see(self, state: Array) -> None:
        """Take down one more moment; `state` is kept."""
        self._states.append(state)

    def occupancy(self, cell: float) -> TrueOccupancy:
        """The share of the moments so far in which each cell was occupied, and the cells now.

        cell  m, its side
        """
        positive_number("cell", cell)
        taken, raster = self._rasters.get(cell, (0, None))
        for start in range(taken, len(self._states), CHUNK):
            edges = self._outlines(np.array(self._states[start : start + CHUNK]))
            if raster is None:
                raster = TrueOccupancy(Truth(np.empty((0, 3)), self._walls, edges), cell)
            else:
                raster.add(edges)
        assert raster is not None  # an episode has a first moment
        self._rasters[cell] = len(self._states), raster
        return copy.copy(raster)  # its arrays are replaced, not changed, by further moments
