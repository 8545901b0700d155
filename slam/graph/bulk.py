"""Drawing many scans into a map that is not read in between."""

from __future__ import annotations

import numpy as np

from slam.geometry import Pose2
from slam.interface import MapModel
from slam.kernel import kernel
from slam.maps.static import Static
from slam.maps.tiles import AREA
from slam.scan import Scan

AT_ONCE = 64  # arrays of changed cells, after which they become one
NO_CELLS = np.empty(0, dtype=np.int64)  # cell ids


class Bulk:
    """Integrates scans into `map_model`, with the same result as one by one; h of a `Static` map is
    computed when they are finished, once for each cell instead of at each scan that sees it. Until
    then the map must be neither read nor forked."""

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
        if len(self._changed) < 2:  # as at each step of an environment that shows the map
            return self._changed[0] if self._changed else NO_CELLS
        return _each_once(np.concatenate(self._changed), self._map_model.cells.tiles.used)


@kernel
def _each_once(ids, slots):
    """(m,) the cells of `ids` (n,), each once and in their order, in a map of so many slots."""
    number, used = np.full(slots, -1), 0  # of each tile among those that hold them
    for k in range(len(ids)):
        slot = ids[k] // AREA
        if number[slot] < 0:
            number[slot], used = used, used + 1
    seen = np.zeros((used, AREA), np.bool_)
    for k in range(len(ids)):
        seen[number[ids[k] // AREA], ids[k] % AREA] = True
    cells, n = np.empty(seen.sum(), np.int64), 0
    for slot in range(slots):
        for cell in range(AREA if number[slot] >= 0 else 0):
            if seen[number[slot], cell]:
                cells[n], n = slot * AREA + cell, n + 1
    return cells
