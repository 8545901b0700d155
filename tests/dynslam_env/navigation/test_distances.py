"""Distances are those of scipy's transform, to the last digit."""

from typing import Any

import numpy as np
import pytest
from scipy import ndimage

from dynslam_env.navigation.distances import distances


def raster(seed: int) -> np.ndarray:
    """Scattered cells, or walls, in a raster of any shape."""
    rng = np.random.default_rng(seed)
    rows, cols = rng.integers(1, 60, 2).tolist()
    cells = rng.random((rows, cols)) < rng.choice([0.01, 0.05, 0.3])
    if seed % 2:
        cells[:] = False
        cells[rng.integers(rows), rng.integers(cols) :] = True
        cells[rng.integers(rows) :, rng.integers(cols)] = True
    return cells


@pytest.mark.parametrize("seed", range(60))
@pytest.mark.parametrize("resolution", [0.1, 0.15, 1.0])
def test_it_is_scipys(seed: int, resolution: float) -> None:
    cells = raster(seed)
    if not cells.any():
        return
    theirs: Any = ndimage.distance_transform_edt(~cells, sampling=resolution)
    np.testing.assert_array_equal(distances(cells, resolution), theirs)


def test_of_nothing_nothing_is_near() -> None:
    assert np.isinf(distances(np.zeros((3, 4), np.bool_), 0.1)).all()
    assert distances(np.zeros((0, 0), np.bool_), 0.1).shape == (0, 0)
