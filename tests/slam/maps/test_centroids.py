import numpy as np
import pytest

from slam.maps.centroids import MAX_ECHOES, UNIT, Centroids
from slam.maps.tiles import Tiles
from tests.slam import naive
from tests.slam.maps.driving import at, id_of

RESOLUTION = 0.5


def centroids() -> Centroids:
    """Centroids with tiles allocated for (-32, 32) x (-32, 32) m."""
    tiles = Tiles(RESOLUTION)
    result = Centroids(tiles)
    tiles.extend((-31.0, -31.0), (31.0, 31.0))
    tiles.index[:] = np.arange(1, tiles.index.size + 1).reshape(tiles.index.shape)
    tiles.allocate(tiles.index.size + 1)
    return result


def test_mean_of_the_echoes_of_each_cell() -> None:
    rng = np.random.default_rng(1)
    echoes = rng.uniform(-1.0, 1.0, (80, 2))
    means = centroids()
    means.add(echoes[:30])
    means.add(echoes[30:])
    offset, count = means.dense()
    spec = means.tiles.spec
    cells = spec.cells(echoes)
    for cell in np.unique(cells, axis=0):
        within = echoes[(cells == cell).all(axis=1)]
        expected = within.mean(axis=0) - spec.centres(cell[None])[0]
        np.testing.assert_allclose(offset[tuple(cell)], expected, atol=5 * UNIT * RESOLUTION)
        assert count[tuple(cell)] == len(within)
    assert count.sum() == 80
    assert not offset[count == 0].any()


def test_memory_follows_what_moved() -> None:
    means = centroids()
    cell = at(means.tiles, (0, 0))
    for _ in range(2 * MAX_ECHOES):
        means.add(np.array([[0.05, 0.25]]))
    assert means.dense()[0][cell] == pytest.approx((-0.2, 0.0), abs=1e-4)
    for k in range(1, 2 * MAX_ECHOES):  # each new echo is a share of 1 / MAX_ECHOES of the way
        means.add(np.array([[0.45, 0.25]]))
        expected = 0.2 - 0.4 * (1 - 1 / MAX_ECHOES) ** k
        assert means.dense()[0][*cell, 0] == pytest.approx(
            expected, abs=MAX_ECHOES * UNIT * RESOLUTION
        )
    assert means.dense()[1][cell] == MAX_ECHOES


@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("inside", [1e-3, 1e-6, 1e-9, 1e-12])
def test_an_echo_next_to_the_border_of_its_cell_stays_on_its_side(axis: int, inside: float) -> None:
    for side, expected in ((0.5 - inside, 0.25), (inside, -0.25)):
        means = centroids()
        echo = np.full(2, 0.25)
        echo[axis] = side
        means.add(echo[None])
        found = means.offset.flat[id_of(means.tiles, naive.cell(echo, RESOLUTION))]
        assert found[axis] * UNIT * RESOLUTION == pytest.approx(expected, abs=1e-3 + 1e-5)
        assert found[1 - axis] == 0


def test_growing_keeps_each_cells_mean() -> None:
    means = centroids()
    means.add(np.array([[1.1, 2.2]]))
    means.tiles.extend((-90.0, -90.0), (90.0, 90.0))
    offset, count = means.dense()
    row, col = means.tiles.spec.cells(np.array([[1.1, 2.2]]))[0]
    assert offset.shape == (*means.tiles.spec.shape, 2)
    assert count[row, col] == count.sum() == 1
    assert offset[row, col] == pytest.approx((-0.15, -0.05), abs=1e-5)
