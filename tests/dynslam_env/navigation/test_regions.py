"""Clusters and the cells around some, against scipy's and the definition."""

from typing import Any

import numpy as np
import pytest
from scipy import ndimage

from dynslam_env.navigation.regions import (
    EIGHT_NEIGHBOURS,
    FOUR_NEIGHBOURS,
    dilated,
    disc,
    extent,
    grouped,
    loose_clusters,
)

CROSS = np.array([(0, 1, 0), (1, 1, 1), (0, 1, 0)])


def drawn(seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return rng.random(rng.integers(1, 40, 2)) < rng.choice([0.02, 0.1, 0.4])


def labelled(cells: np.ndarray, joined: np.ndarray, least: int) -> list[list[list[int]]]:
    """The sets of `cells` that scipy finds in `joined`."""
    labels: Any = ndimage.label(joined, np.ones((3, 3)))
    sets = [np.argwhere(cells & (labels[0] == k + 1)) for k in range(labels[1])]
    return [one.tolist() for one in sets if len(one) >= least]


@pytest.mark.parametrize("seed", range(40))
@pytest.mark.parametrize("least", [1, 4])
def test_clusters_are_scipys_in_the_same_order(seed: int, least: int) -> None:
    cells = drawn(seed)
    found, ends = grouped(cells)
    sets = [one.T.tolist() for one in np.split(found, ends, axis=1)[:-1]]
    assert [one for one in sets if len(one) >= least] == labelled(cells, cells, least)
    joined = np.asarray(ndimage.binary_dilation(cells, np.ones((3, 3))))
    assert [one.tolist() for one in loose_clusters(cells, least)] == labelled(cells, joined, least)


@pytest.mark.parametrize("seed", range(20))
def test_dilation_is_scipys(seed: int) -> None:
    cells = drawn(seed)
    for shape, theirs in ((FOUR_NEIGHBOURS, CROSS), (EIGHT_NEIGHBOURS, np.ones((3, 3)))):
        np.testing.assert_array_equal(dilated(cells, shape), ndimage.binary_dilation(cells, theirs))


@pytest.mark.parametrize("distance", [0.05, 0.1, 0.25, 0.6])
@pytest.mark.parametrize("border", [0.0, 0.05])
def test_a_disc_holds_the_cells_within_the_distance(distance: float, border: float) -> None:
    cells = np.zeros((21, 21), np.bool_)
    cells[10, 10] = True
    rows, cols = np.indices(cells.shape) - 10
    away = np.sqrt((rows * 0.1) ** 2 + (cols * 0.1) ** 2) - border
    np.testing.assert_array_equal(dilated(cells, disc(0.1, distance, border)), away <= distance)


def test_the_extent_holds_all_cells() -> None:
    cells = np.zeros((9, 9), np.bool_)
    assert not cells[extent(cells)].size
    cells[2, 5] = cells[4, 3] = True
    assert extent(cells) == (slice(2, 5), slice(3, 6))
    assert extent(cells, 3) == (slice(0, 8), slice(0, 9))
