import numpy as np
import pytest

from slam.grid import GridSpec
from slam.maps.centroids import Centroids

SPEC = GridSpec(0.5, -64, -64, 128, 128)


def test_mean_of_the_echoes_of_each_cell() -> None:
    rng = np.random.default_rng(1)
    echoes = rng.uniform(-1.0, 1.0, (80, 2))
    centroids = Centroids(SPEC)
    centroids.add(SPEC, echoes[:30])
    centroids.add(SPEC, echoes[30:])
    cells = SPEC.cells(echoes)
    for cell in np.unique(cells, axis=0):
        within = echoes[(cells == cell).all(axis=1)]
        expected = within.mean(axis=0) - SPEC.centres(cell[None])[0]
        np.testing.assert_allclose(centroids.offset[tuple(cell)], expected, atol=1e-6)
        assert centroids.count[tuple(cell)] == len(within)
    assert centroids.count.sum() == 80
    assert not centroids.offset[centroids.count == 0].any()


def test_memory_follows_what_moved() -> None:
    centroids = Centroids(SPEC, memory=2)
    row, col = SPEC.cells(np.array([[0.1, 0.1]]))[0]
    for _ in range(100):
        centroids.add(SPEC, np.array([[0.05, 0.25]]))
    assert centroids.offset[row, col] == pytest.approx((-0.2, 0.0), abs=1e-6)
    for k in range(1, 5):  # with two to remember, each new echo halves the way
        centroids.add(SPEC, np.array([[0.45, 0.25]]))
        assert centroids.offset[row, col, 0] == pytest.approx(0.2 - 0.4 / 2**k, abs=1e-6)
    assert centroids.count[row, col] == 2


def test_growing_keeps_each_cells_mean() -> None:
    centroids = Centroids(GridSpec(0.5, 0, 0, 64, 64))
    centroids.add(GridSpec(0.5, 0, 0, 64, 64), np.array([[1.1, 2.2]]))
    centroids.grow(GridSpec(0.5, 0, 0, 64, 64), SPEC)
    row, col = SPEC.cells(np.array([[1.1, 2.2]]))[0]
    assert centroids.offset.shape == (128, 128, 2)
    assert centroids.count[row, col] == centroids.count.sum() == 1
    assert centroids.offset[row, col] == pytest.approx((-0.15, -0.05), abs=1e-6)
