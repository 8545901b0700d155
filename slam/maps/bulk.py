"""Drawing many scans into a map that is not read in between."""

from __future__ import annotations

import numpy as np

from slam.geometry import Pose2
from slam.interface import MapModel
from slam.maps.static import Static
from slam.scan import Scan

AT_ONCE = 64  # lists of changed cells, after which they become one


class Bulk:
    """Integrates scans into `map_model`, with the same result as one by one; h of a `Static` map is
    computed when they are finished, once for each cell instead of at each scan that sees it."""

    def __init__(self, map_model: MapModel):
        self._map_model, self._changed = map_model, list[np.ndarray]()
        later = isinstance(map_model, Static)
        self._integrate = map_model.accumulate if later else map_model.integrate

    def integrate(self, scan: Scan, pose: Pose2) -> None:
        """Integrate a scan taken at `pose`."""
        if len(self._changed) == AT_ONCE:
            self._changed = [self._once()]
        self._changed.append(self._integrate(scan, pose))

    def finish(self) -> np.ndarray:
        """(n,) int64 the ids of the cells that may have changed since the last call, each once."""
        cells, self._changed = self._once(), []
        if isinstance(self._map_model, Static):
            self._map_model.settle(cells)
        return cells

    def _once(self) -> np.ndarray:
        """(n,) the ids of all cells so far, each once: scans see the same ones."""
        found = np.zeros(len(self._map_model.cells.observed.flat), np.bool_)
        for ids in self._changed:
            found[ids] = True
        return np.flatnonzero(found)
