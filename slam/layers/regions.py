"""Connected regions of cells."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import find_objects, label

EIGHT_NEIGHBOURS = np.ones((3, 3), np.bool_)


def components(cells: np.ndarray) -> tuple[np.ndarray, int]:
    """Label the connected components (of 8 neighbours) of `cells` (rows, cols), from 1 on; returns
    the labels and the number of components."""
    labels = np.zeros(cells.shape, np.int32)
    count = label(cells, EIGHT_NEIGHBOURS, output=labels)
    return labels, int(count)  # pyright: ignore[reportArgumentType]


def extents(labels: np.ndarray) -> np.ndarray:
    """(components + 1,) the larger of height and width, cells, of each component; 0 of no one."""
    boxes = find_objects(labels)
    sides = [max(part.stop - part.start for part in box) if box else 0 for box in boxes]
    return np.array([0, *sides])
