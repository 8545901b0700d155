import numpy as np
import pytest

from slam.geometry import Pose2
from slam.maps.outline import LINE, NOTHING, POINT, Outline
from slam.maps.static import Static
from slam.maps.surfaces import COUNT, INITIAL_ROWS, MAX_ECHOES, NONE, TX, TY, Surfaces, X, Y
from slam.maps.tiles import Tiles
from tests.slam import naive
from tests.slam.maps.driving import id_of
from tests.slam.worlds import FAN, loop, scan_at

RESOLUTION = 0.05


def surfaces(side: float = 3.0) -> Surfaces:
    """Surfaces with all tiles allocated around the origin."""
    tiles = Tiles(RESOLUTION)
    result = Surfaces(tiles)
    tiles.extend((-side, -side), (side, side))
    tiles.index[:] = np.arange(1, tiles.index.size + 1).reshape(tiles.index.shape)
    tiles.allocate(tiles.index.size + 1)
    return result


def of_cell(kept: Surfaces, cell: tuple[int, int]) -> list[np.ndarray]:
    """The rows of the table of a cell."""
    rows, row = [], kept.first.flat[id_of(kept.tiles, cell)]
    while row != NONE:
        rows.append(kept.table[row])
        row = kept.next[row]
    return rows


def echoes(points, tangent=None, kind=LINE) -> Outline:
    points = np.asarray(points, dtype=float)
    tangents = np.zeros_like(points) if tangent is None else np.tile(tangent, (len(points), 1))
    return Outline(points, tangents, np.full(len(points), kind, np.uint8))


def test_each_cell_keeps_the_mean_of_its_echoes_for_each_direction() -> None:
    rng = np.random.default_rng(2)
    kept = surfaces()
    points = rng.uniform(0.0, 0.3, (200, 2))
    for tangent in ((1.0, 0.0), (0.0, -1.0)):
        kept.add(echoes(points[:100], tangent), Pose2())
        points = points[100:]
    points = np.random.default_rng(2).uniform(0.0, 0.3, (200, 2))
    cells = [naive.cell(point, RESOLUTION) for point in points]
    for cell in set(cells):
        for side, tangent in ((slice(0, 100), (1.0, 0.0)), (slice(100, 200), (0.0, 1.0))):
            within = [p for p, c in zip(points[side], cells[side], strict=True) if c == cell]
            same = [row for row in of_cell(kept, cell) if abs(row[[TX, TY]] @ tangent) > 0.99]
            assert len(same) == min(len(within), 1)
            if within:
                np.testing.assert_allclose(same[0][[X, Y]], np.mean(within, axis=0))
                assert same[0][COUNT] == len(within)


def test_tangents_turn_with_the_robot_and_their_sign_does_not_matter() -> None:
    kept, heading = surfaces(), 0.7
    c, s = np.cos(heading), np.sin(heading)
    for sign in (1.0, -1.0):
        kept.add(echoes([[1.0, 0.0]], (sign * 0.6, sign * 0.8)), Pose2(0.2, 0.1, heading))
    (row,) = of_cell(kept, naive.cell((0.2 + c, 0.1 + s), RESOLUTION))
    expected = np.array([0.6 * c - 0.8 * s, 0.6 * s + 0.8 * c])
    assert abs(row[[TX, TY]] @ expected) == pytest.approx(1.0)
    assert row[COUNT] == 2


def test_points_are_apart_from_lines_and_lone_echoes_are_left_out() -> None:
    kept = surfaces()
    kept.add(echoes([[0.01, 0.01]], (0.0, 1.0)), Pose2())
    kept.add(echoes([[0.04, 0.02], [0.02, 0.04]], kind=POINT), Pose2())
    kept.add(echoes([[0.03, 0.03]], kind=NOTHING), Pose2())
    point, line = of_cell(kept, (0, 0))
    assert point[[X, Y, TX, TY, COUNT]] == pytest.approx([0.03, 0.03, 0.0, 0.0, 2])
    assert line[[X, Y, COUNT]] == pytest.approx([0.01, 0.01, 1])


def test_memory_follows_what_moved() -> None:
    kept = surfaces()
    for _ in range(2 * MAX_ECHOES):
        kept.add(echoes([[0.01, 0.02]], (0.0, 1.0)), Pose2())
    for k in range(1, 2 * MAX_ECHOES):
        kept.add(echoes([[0.04, 0.02]], (0.0, 1.0)), Pose2())
        (row,) = of_cell(kept, (0, 0))
        assert row[X] == pytest.approx(0.04 - 0.03 * (1 - 1 / MAX_ECHOES) ** k)
        assert row[COUNT] == MAX_ECHOES


def test_the_table_grows_and_keeps_what_it_had() -> None:
    kept = surfaces(side=6.0)
    points = np.stack(np.meshgrid(*[np.arange(40) * RESOLUTION + 0.02] * 2), axis=-1).reshape(-1, 2)
    for part in np.array_split(points, 9):
        kept.add(echoes(part, (1.0, 0.0)), Pose2())
    assert len(points) > INITIAL_ROWS
    for point in points:
        (row,) = of_cell(kept, naive.cell(point, RESOLUTION))
        assert row[[X, Y]] == pytest.approx(point)
    assert kept.nbytes >= len(points) * 60


def test_echoes_where_no_tile_is_are_ignored() -> None:
    kept = surfaces()
    kept.add(echoes([[500.0, 3.0], [-500.0, -3.0]], (1.0, 0.0)), Pose2())
    assert not kept.first.values.any()


def test_they_grow_with_the_map_that_they_belong_to() -> None:
    grid = Static()
    kept = Surfaces(grid.cells.tiles)
    for pose in loop(10):
        scan = scan_at(Pose2.of(pose), angles=FAN)
        grid.integrate(scan, Pose2.of(pose))
        kept.add(echoes(scan.points, (1.0, 0.0)), Pose2.of(pose))
    holding = grid.cells.tiles.dense(kept.first) != NONE
    np.testing.assert_array_equal(holding, grid.cells.tiles.dense(grid.cells.centroids.count) > 0)
