"""Regions of a raster: clusters of cells, dilation, and distances."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from slam.geometry import Array
from slam.kernel import kernel

Bools = NDArray[np.bool_]
Cells = NDArray[np.int64]

FOUR_NEIGHBOURS = np.array([(0, 1, 0), (1, 1, 1), (0, 1, 0)], dtype=np.bool_)
EIGHT_NEIGHBOURS = np.ones((3, 3), dtype=np.bool_)


def clusters(cells: Bools, min_cells: int = 1) -> list[Cells]:
    """The 8-connected sets of cells: (n, 2) rows and columns each.

    cells      (rows, cols)
    min_cells  of a set; smaller ones are left out
    """
    return _parts(cells, cells, min_cells)


def loose_clusters(cells: Bools, min_cells: int = 1) -> list[Cells]:
    """The same, with gaps of up to two cells allowed within a cluster."""
    return _parts(cells, dilated(cells, EIGHT_NEIGHBOURS), min_cells)


def dilated(cells: Bools, shape: Bools) -> Bools:
    """(rows, cols) `cells` and their neighbours, FOUR_NEIGHBOURS or EIGHT_NEIGHBOURS."""
    found: Any = ndimage.binary_dilation(cells, shape)
    return found


def distance_to(cells: Bools, resolution: float) -> Array:
    """(rows, cols) m to the centre of the nearest of `cells`; inf if there is none."""
    if not cells.any():
        return np.full(cells.shape, np.inf)
    found: Any = ndimage.distance_transform_edt(~cells, sampling=resolution)
    return found


def around(cells: Bools, offsets: Cells) -> Bools:
    """(rows, cols) whether one of `cells` lies at one of `offsets` (n, 2), rows and columns, which
    are symmetric."""
    return _stamped(np.argwhere(cells), offsets, np.zeros_like(cells))


@kernel
def _stamped(cells, offsets, found):
    rows, cols = found.shape
    for k in range(len(cells)):
        for n in range(len(offsets)):
            row, col = cells[k, 0] + offsets[n, 0], cells[k, 1] + offsets[n, 1]
            if 0 <= row < rows and 0 <= col < cols:
                found[row, col] = True
    return found


def nearest_of(cells: Bools, resolution: float) -> tuple[Array, NDArray[np.int32]]:
    """(rows, cols) m to the nearest of `cells`, and (2, rows, cols) its row and column; inf and
    zeros if there is none."""
    if not cells.any():
        return np.full(cells.shape, np.inf), np.zeros((2, *cells.shape), dtype=np.int32)
    found: Any = ndimage.distance_transform_edt(~cells, sampling=resolution, return_indices=True)
    return found


def _parts(cells: Bools, joined: Bools, min_cells: int) -> list[Cells]:
    """Those of `cells` in each 8-connected set of `joined`."""
    labelled: Any = ndimage.label(joined, EIGHT_NEIGHBOURS)
    labels = np.where(cells, labelled[0], 0)
    sizes = np.bincount(labels.ravel())
    found = []
    for label, window in enumerate(ndimage.find_objects(labels), start=1):
        if window is not None and sizes[label] >= min_cells:
            here = np.argwhere(labels[window] == label)
            found.append(here + [part.start for part in window])
    return found
