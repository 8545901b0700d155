import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slam.geometry import Pose2, transform_points
from slam.graph.branch_and_bound import FEW, LONG_ROW, SQUARE, bounds_of, runs_of
from slam.graph.global_search import (
    ANYWHERE,
    CANDIDATE_CELL,
    MAX_POINTS,
    OTHER_DISTANCE,
    TURN_STEP,
    GlobalSearch,
)
from slam.maps.static import Static
from slam.scan import Scan
from slam.sensor_models.endpoint import Endpoint
from slam.sensor_models.pyramid import MAX_UNITS
from tests.slam.worlds import loop, scan_at

seeds = st.integers(0, 2**32 - 1)
EVERY = np.radians(np.arange(-180, 180, 6.0))


def random_map(rng) -> tuple[Static, Endpoint]:
    """A map of a few random scans."""
    grid, reading = Static(), Endpoint()
    for _ in range(2):
        scan = Scan(rng.uniform(0.3, 3.0, len(EVERY)), EVERY, 2.8)
        reading.refresh(grid, grid.integrate(scan, Pose2.of(rng.normal(0, 0.5, 3))))
    return grid, reading


def pooled(grid, reading) -> dict[tuple[int, int], float]:
    """The field's maxima over squares of CANDIDATE_CELL x CANDIDATE_CELL cells."""
    tiles, result = grid.cells.tiles, {}
    for (row, col), value in np.ndenumerate(tiles.dense(reading.field())):
        at = (row + tiles.row0) // CANDIDATE_CELL, (col + tiles.col0) // CANDIDATE_CELL
        result[at] = max(result.get(at, -math.inf), float(value))
    return result


def value(known, unknown, points, pose: Pose2, side: float) -> float:
    """The sum of the field at the points."""
    cells = np.floor(transform_points(pose, points) / side).astype(int)
    return sum(known.get((row, col), unknown) for col, row in cells.tolist())


def window(around: Pose2, reach, side: float):
    """All candidates."""
    n, turns = (math.ceil(r / s) for r, s in ((reach[0], side), (reach[2], TURN_STEP)))
    m = math.ceil(reach[1] / side)
    for turn in range(-turns, turns + 1):
        for i in range(-m, m + 1):
            for j in range(-n, n + 1):
                x, y = around.x + j * side, around.y + i * side
                yield Pose2(x, y, math.remainder(around.theta + turn * TURN_STEP, math.tau))


@pytest.mark.parametrize("farthest", [(0.7, 0.7, math.radians(1.2)), (4.0, 3.0, 0.0)])
@settings(max_examples=12)
@given(seeds, st.booleans())
def test_the_best_is_as_good_as_the_best_of_all(farthest, seed: int, far: bool) -> None:
    rng = np.random.default_rng(seed)
    grid, reading = random_map(rng)
    points = rng.uniform(-2.5, 2.5, (12, 2))
    reach = rng.uniform(0.5, 1.0, 3) * farthest
    around = Pose2.of(rng.normal(0, (3.0, 3.0, 3.0) if far else (0.4, 0.4, 2.0)))
    side, known = CANDIDATE_CELL * grid.cells.tiles.resolution, pooled(grid, reading)
    values = {
        pose: value(known, reading.unknown, points, pose, side)
        for pose in window(around, reach, side)
    }
    found = GlobalSearch(reading).best(points, around, reach)
    nearest = min(values, key=lambda pose: np.abs(np.subtract(pose, found)).max())
    assert nearest == pytest.approx(found, abs=1e-9)  # it is a candidate
    rounding = len(points) * (reading.top - reading.nothing) / MAX_UNITS
    assert values[nearest] == pytest.approx(max(values.values()), abs=rounding)


@settings(max_examples=40)
@given(seeds, st.tuples(st.floats(0, 4.0), st.floats(0, 4.0), st.floats(0, 0.8)))
def test_the_window_is_not_left_by_more_than_a_candidate(seed: int, reach) -> None:
    rng = np.random.default_rng(seed)
    grid, reading = random_map(rng)
    around = Pose2.of(rng.uniform(-3.0, 3.0, 3))
    search = GlobalSearch(reading)
    found = search.best(rng.normal(0, 2.0, (40, 2)), around, np.array(reach))
    side = CANDIDATE_CELL * grid.cells.tiles.resolution + 1e-9
    assert abs(found.x - around.x) < reach[0] + side
    assert abs(found.y - around.y) < reach[1] + side
    assert abs(math.remainder(found.theta - around.theta, math.tau)) < reach[2] + TURN_STEP + 1e-9
    alone = search.best(rng.normal(0, 2.0, (40, 2)), around, np.zeros(3))
    assert tuple(alone) == pytest.approx(tuple(around))


@pytest.mark.parametrize(
    "around", [Pose2(60.0, -70.0, 1.0), Pose2(-1e4, 1e4, -3.0), Pose2(7.0, 7.0)]
)
def test_where_nothing_is_known_all_are_equal(around: Pose2) -> None:
    _, reading = random_map(np.random.default_rng(0))
    search, reach = GlobalSearch(reading), np.array([2.0, 2.0, 0.1])
    found = search.best(np.random.default_rng(1).normal(0, 0.2, (9, 2)), around, reach)
    assert (np.abs(np.subtract(found, around)) <= reach + (0.1, 0.1, TURN_STEP)).all()


def test_a_view_without_points_and_a_map_without_tiles_are_lived_with() -> None:
    empty = Static(), Endpoint()
    blind = Scan(np.full(5, math.nan), np.zeros(5), 3.0)
    empty[1].refresh(empty[0], empty[0].integrate(blind, Pose2()))
    reach = np.array([0.3, 0.2, 0.05])
    for _, reading in (empty, random_map(np.random.default_rng(0))):
        search = GlobalSearch(reading)
        for points in (np.zeros((0, 2)), np.ones((3, 2))):
            found = search.best(points, Pose2(1.0, 2.0, 0.5), reach)
            assert (
                np.abs(np.subtract(found, (1.0, 2.0, 0.5))) <= reach + (0.1, 0.1, TURN_STEP)
            ).all()


@pytest.mark.parametrize("off", [(1.5, -1.2, 0.5), (-1.9, 1.9, -0.6), (0.0, 0.0, 0.0)])
def test_a_view_of_the_room_is_found(off) -> None:
    grid, reading = Static(), Endpoint()
    for pose in loop(12):
        reading.refresh(grid, grid.integrate(scan_at(Pose2.of(pose)), Pose2.of(pose)))
    truth = Pose2(0.3, 0.1, 2.0)
    points = np.repeat(scan_at(truth).points, 3, axis=0)
    assert len(points) > MAX_POINTS
    around = Pose2(*np.add(truth, off).tolist())
    found = GlobalSearch(reading).best(points, around, np.array([2.0, 2.0, 0.7]))
    assert np.hypot(found.x - truth.x, found.y - truth.y) < 0.1
    assert abs(found.theta - truth.theta) < math.radians(1.5)


@settings(max_examples=10)
@given(seeds)
def test_the_candidates_are_places_of_their_own_the_best_one_first(seed: int) -> None:
    rng = np.random.default_rng(seed)
    grid, reading = random_map(rng)
    points, reach = rng.uniform(-2.5, 2.5, (12, 2)), np.array([2.0, 2.0, 0.1])
    search, side, known = GlobalSearch(reading), 0.1, pooled(grid, reading)
    found = search.candidates(points, Pose2(), reach, most=3)
    best = search.best(points, Pose2(), reach)
    (other,) = search.candidates(points, Pose2(), reach, but=[found[0]])
    for k, one in enumerate(found):
        assert all(math.dist(one[:2], two[:2]) > OTHER_DISTANCE - 1e-9 for two in found[:k])
    assert math.dist(other[:2], found[0][:2]) > OTHER_DISTANCE - 1e-9
    sums = [value(known, reading.unknown, points, pose, side) for pose in (*found, best, other)]
    rounding = len(points) * (reading.top - reading.nothing) / MAX_UNITS
    assert sums[0] == pytest.approx(sums[3], abs=rounding)
    assert sums[0] >= sums[1] - rounding >= sums[2] - 2.0 * rounding
    assert sums[4] >= sums[1] - rounding  # outside of its circle it is the best of all


def test_no_candidate_is_below_the_least() -> None:
    rng = np.random.default_rng(2)
    _, reading = random_map(rng)
    points, reach = rng.uniform(-2.5, 2.5, (12, 2)), np.array([1.0, 1.0, 0.1])
    search = GlobalSearch(reading)
    assert search.candidates(points, Pose2(), reach, least=reading.top) == []
    assert len(search.candidates(points, Pose2(), reach, most=3, least=reading.nothing)) == 3


@pytest.mark.parametrize("row", range(-5, 6))
@pytest.mark.parametrize("wide", [6, FEW, FEW + 1, LONG_ROW - 1, LONG_ROW, 40])
@pytest.mark.parametrize("broad", [4, 60])
def test_of_points_beside_the_map_nothing_is_added(row: int, wide: int, broad: int) -> None:
    phase = np.arange(1, 3 * broad + 1, dtype=np.uint16).reshape(3, broad)
    phases = np.full((SQUARE, SQUARE, 3, broad), 999, np.uint16)  # of other points
    phases[0, 0] = phase
    window = np.array([(wide - 1) * SQUARE // 2, 2])
    runs, squares = runs_of(ANYWHERE, np.zeros(2), window)
    for col in range(-12, 13):
        expected = np.zeros((2, wide), np.uint16)
        for a, b in np.ndindex(expected.shape):
            if 0 <= row + a < 3 and 0 <= col + b < broad:
                expected[a, b] = phase[row + a, col + b]
        rows, cols = np.array([[row * SQUARE + window[1]]]), np.array([[col * SQUARE + window[0]]])
        box = np.column_stack([rows, rows, cols, cols])
        found = bounds_of(phases, (rows, cols, box, rows), runs, len(squares), window, 0)
        np.testing.assert_array_equal(found[0], expected.ravel())


@pytest.mark.parametrize("wide", [6, FEW, FEW + 1, LONG_ROW, 40])
def test_bounds_are_sums_over_all_points_at_each_turn(wide: int) -> None:
    rng, tall, broad, high = np.random.default_rng(wide), 20, 30, 7
    phases = rng.integers(0, 255, (SQUARE, SQUARE, tall, broad)).astype(np.uint16)
    window = np.array([(wide - 1) * SQUARE // 2, (high - 1) * SQUARE // 2])
    rows, cols = rng.integers(-20, 100, (2, 3, 9))  # of nine points at three turns
    box = np.stack([rows.min(1), rows.max(1), cols.min(1), cols.max(1)], axis=1)
    expected = np.zeros((3, high, wide), np.uint16)
    for t, k, a, b in np.ndindex(3, 9, high, wide):
        (i, row), (j, col) = (
            divmod(rows[t, k] - window[1], SQUARE),
            divmod(cols[t, k] - window[0], SQUARE),
        )
        if 0 <= i + a < tall and 0 <= j + b < broad:
            expected[t, a, b] += phases[row, col, i + a, j + b]
    runs, squares = runs_of(ANYWHERE, np.zeros(2), window)
    found = bounds_of(phases, (rows, cols, box, rows), runs, len(squares), window, 0)
    np.testing.assert_array_equal(found, expected.reshape(3, -1))
    standing = rng.random((2, high * SQUARE, wide * SQUARE)) < 0.3
    runs, squares = runs_of(standing, window.astype(np.float64), window)
    some = standing[1, ::SQUARE, ::SQUARE]
    np.testing.assert_array_equal(squares, np.argwhere(some) * SQUARE)
    found = bounds_of(phases, (rows, cols, box, rows), runs, len(squares), window, 0)
    np.testing.assert_array_equal(found, expected[:, some])
