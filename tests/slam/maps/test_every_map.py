"""Properties of every map model."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slam.errors import InputError
from slam.geometry import Pose2
from slam.maps.cells import Cells
from slam.maps.centroids import UNIT
from slam.maps.rays import Rays
from slam.maps.static import Static
from slam.maps.temporal import Temporal
from slam.maps.tiles import AREA
from slam.scan import Scan
from tests.slam import naive
from tests.slam.maps.driving import (
    CLOSED,
    DOOR,
    EVIDENCE,
    HIDDEN,
    MODELS,
    OPEN,
    ROBOT,
    WALL,
    at,
    drive,
    h,
    id_of,
    integrated,
    lattice,
    readings,
    watched,
)
from tests.slam.worlds import beam, loop, scan_at

every_model = pytest.mark.parametrize("model", MODELS)
MAX_BYTES = 18  # of a cell in a model's own layers: a building of 200 x 200 m has 16 million cells


@every_model
def test_centroids_are_those_of_all_echoes(model) -> None:
    history = drive()
    grid = integrated(model(), history)
    expected = naive.centroids(history, 0.05)
    offset, count = grid.cells.centroids.dense()
    assert np.count_nonzero(count) == len(expected)
    for cell, mean in expected.items():
        np.testing.assert_allclose(offset[at(grid.cells.tiles, cell)], mean, atol=9 * UNIT * 0.05)


@every_model
def test_all_that_changes_was_seen_and_is_told(model) -> None:
    grid = model()
    tiles = grid.cells.tiles
    before: dict[tuple[int, int], float] = {}
    for scan, pose in drive(9):
        changed = grid.integrate(scan, pose)
        cells = lattice(tiles, changed)
        assert len(set(cells)) == len(cells)
        seen = naive.seen(scan, pose, 0.05)
        assert set(cells) <= seen.keys()
        now = {cell: h(grid, cell) for cell in before.keys() | seen.keys()}
        blank = np.float32(grid.cells.prior)
        assert {cell for cell in now if before.get(cell, blank) != now[cell]} <= set(cells)
        assert {cell for cell, hit in seen.items() if hit} <= set(cells)
        before = now
        observed = tiles.dense(grid.cells.observed)
        assert observed.sum() == len(before)


@every_model
def test_what_was_not_seen_has_the_prior(model) -> None:
    for prior in (0.2, 0.4):
        grid = integrated(model(evidence=type(EVIDENCE)(prior=prior)), drive()).cells.grid()
        assert (grid.occupied[~grid.observed] == np.float32(prior)).all()
        assert (grid.occupied[grid.observed] != np.float32(prior)).mean() > 0.9
        assert grid.occupied.dtype == np.float32


@every_model
def test_the_blank_tile_stays_blank(model) -> None:
    grid = integrated(model(), drive())
    for layer in grid.cells.tiles._layers:
        blank = layer.values[0]
        assert np.array_equal(blank, np.full_like(blank, layer.fill))


@every_model
def test_the_same_history_gives_the_same_map_however_it_grew(model) -> None:
    far = [Pose2(3.0 * x, 3.0 * y, 1.0 * k) for k, (x, y) in
           enumerate([(0, 0), (1, 0), (0, 1), (-1, 0), (0, -1), (0, 0)])]  # fmt: skip
    history = [(scan_at(Pose2(0.1, 0.1), time=k), pose) for k, pose in enumerate(far)]
    growing, large = model(), model()
    tiles = large.cells.tiles
    tiles.extend((-12, -12), (12, 12))
    tiles.index[:] = 1 + np.random.default_rng(0).permutation(tiles.index.size).reshape(
        tiles.index.shape
    )
    tiles.allocate(tiles.index.size + 1)
    integrated(growing, history)
    integrated(large, history)
    spec = growing.cells.tiles.spec
    assert spec.row0 < 0 < spec.row0 + spec.rows
    assert spec != tiles.spec
    row, col = spec.row0 - tiles.row0, spec.col0 - tiles.col0
    window = np.s_[row : row + spec.rows, col : col + spec.cols]
    own = zip(growing.cells.tiles._layers, tiles._layers, strict=True)
    numbers_of_windows = [growing.last, large.last] if model is Temporal else []
    for small, big in own:
        if small in numbers_of_windows:  # a store has an order of its own
            continue
        dense = growing.cells.tiles.dense(small), tiles.dense(big)[window]
        np.testing.assert_array_equal(*dense)
    assert tiles.dense(large.cells.observed).sum() == growing.cells.grid().observed.sum()


@every_model
def test_samples_are_those_of_the_whole_map(model) -> None:
    driven, rng = model(), np.random.default_rng(3)
    for pose in loop(8):
        driven.integrate(scan_at(Pose2.of(pose)), Pose2.of(pose))
    points = rng.uniform(-3.5, 3.5, (5000, 2))
    found, expected = driven.cells.sample(points), driven.cells.grid().sample(points)
    assert expected[1].mean() > 0.1
    np.testing.assert_array_equal(found[1], expected[1])
    np.testing.assert_array_equal(found[0][found[1]], expected[0][found[1]])


@every_model
def test_a_map_that_was_handed_out_is_left_alone(model) -> None:
    history = drive()
    grid = integrated(model(), history[:4])
    handed_out = grid.cells.grid()
    occupied = handed_out.occupied.copy()
    integrated(grid, history)
    np.testing.assert_array_equal(handed_out.occupied, occupied)


@every_model
def test_agrees_with_the_static_map_where_nothing_changes(model) -> None:
    poses = [Pose2.of(pose) for pose in loop(5)]
    history = [(scan_at(pose, time=5.0 * k + n), pose) for k, pose in enumerate(poses)
               for n in range(4)]  # fmt: skip
    static, other = (integrated(m(), history).cells.grid() for m in (Static, model))
    np.testing.assert_array_equal(static.observed, other.observed)
    apart = (static.occupied > 0.5) != (other.occupied > 0.5)
    assert (static.occupied > 0.5).sum() > 100
    assert apart.sum() < 0.01 * static.observed.sum()


@every_model
def test_a_wall_stays_a_wall_and_the_way_to_it_free(model) -> None:
    # A beam in three ends in the wall; the others pass beside, through the same cells.
    grid = model(1.0)
    watched(grid, (0.0, OPEN))
    for k in range(1, 600):
        grid.integrate(beam(OPEN + (k % 3 > 0) * 2.0, 0.2 * k), ROBOT)
        assert h(grid, WALL) > 0.3
        assert h(grid, DOOR) < 0.2
    assert h(grid, WALL) > 0.5


@every_model
def test_a_wall_is_the_same_after_a_night(model) -> None:
    grid = model(1.0)
    watched(grid, *[(0.2 * k, OPEN) for k in range(300)])
    watched(grid, *[(40_000 + 0.2 * k, OPEN) for k in range(3)])
    assert h(grid, WALL) > 0.6
    assert h(grid, DOOR) < 0.2


@every_model
def test_what_came_by_once_is_forgotten(model) -> None:
    grid = model(1.0)
    watched(grid, *[(0.2 * k, OPEN) for k in range(50)])
    peak = max(watched(grid, *[(10 + 0.2 * k, CLOSED) for k in range(3)]))
    left = watched(grid, *[(10.6 + 0.2 * k, OPEN) for k in range(200)])[-1]
    assert left < 0.25
    assert left <= peak


gaps = st.sampled_from([0.0, 0.1, 0.4, 2.5, 30.0, 5000.0, -0.1, -3.0, -1e9, 1e9])
lengths = st.sampled_from([CLOSED, OPEN, HIDDEN, math.inf, math.nan])
sequences = st.lists(st.tuples(gaps, lengths), max_size=30)


@every_model
@settings(max_examples=30)
@given(sequence=sequences)
def test_no_clock_and_no_reading_breaks_it(model, sequence) -> None:
    grid = model(1.0)
    for time, length in readings(sequence):
        grid.integrate(beam(length, time), ROBOT)
        occupied = grid.cells.occupied.values
        assert ((occupied >= 0) & (occupied <= 1)).all()
    watched(grid, *[(k, CLOSED) for k in range(3)])
    assert grid.cells.grid().observed.any()


@every_model
def test_a_clock_that_begins_anew_does_not_stop_the_learning(model) -> None:
    grid = model(1.0)
    watched(grid, *[(1e9 + 0.2 * k, OPEN) for k in range(20)])
    watched(grid, *[(0.2 * k, OPEN) for k in range(100)])
    assert h(grid, WALL) > 0.8
    before = h(grid, DOOR)
    watched(grid, *[(20 + 0.2 * k, CLOSED) for k in range(300)])
    assert h(grid, DOOR) > before or model.__name__ == "Filtered"


@every_model
def test_scans_that_say_nothing_change_nothing(model) -> None:
    grid = model()
    nothing = Scan(np.full(5, math.nan), np.linspace(-1, 1, 5), 10.0)
    empty = Scan(np.empty(0), np.empty(0), 10.0, time=1.0)
    for scan in (nothing, empty):
        assert grid.integrate(scan, Pose2(1.0, 2.0, 3.0)).tolist() == []
    integrated(grid, drive(4))
    before = grid.cells.grid()
    for scan in (nothing, empty):
        assert grid.integrate(scan, Pose2(1.0, 2.0, 3.0)).tolist() == []
    after = grid.cells.grid()
    np.testing.assert_array_equal(before.occupied, after.occupied)
    np.testing.assert_array_equal(before.observed, after.observed)


@every_model
def test_a_scan_without_echo_clears_the_way(model) -> None:
    grid = model(rays=Rays(no_echo_reach=2.0))
    changed = grid.integrate(Scan(np.full(9, math.inf), np.linspace(-1, 1, 9), 10.0), Pose2())
    assert len(changed) > 200
    assert (grid.cells.occupied.flat[changed] < 0.2).all()
    assert not grid.cells.centroids.count.values.any()


@every_model
def test_a_large_building_fits(model) -> None:
    grid = model()
    tiles = grid.cells.tiles
    own = tiles.nbytes - Cells(0.05, 0.2, Rays()).tiles.nbytes
    assert own / (tiles.used * AREA) <= MAX_BYTES


@every_model
def test_an_echo_on_the_border_of_two_cells_counts_in_the_one_that_was_hit(model) -> None:
    grid = model(evidence=EVIDENCE)
    grid.integrate(beam(1.0), Pose2(-0.2, -0.2))
    for k in range(1, 60):
        pose = Pose2(0.0, 0.025)
        changed = grid.integrate(beam(0.05 * k, 10.0 * k), pose)
        farthest = max(lattice(grid.cells.tiles, changed), key=lambda cell: cell[1])
        assert grid.cells.centroids.count.flat[id_of(grid.cells.tiles, farthest)] > 0


@every_model
def test_a_resolution_that_is_none_is_refused(model) -> None:
    for wrong in (0.0, -1.0, math.nan):
        with pytest.raises(InputError, match="resolution"):
            model(wrong)


@every_model
def test_observed_cells_are_found_in_their_order(model) -> None:
    grid = model(evidence=EVIDENCE)
    for k in range(5):
        grid.integrate(beam(1.0 + k, 10.0 * k), Pose2(0.3 * k, -0.2, k))
        ids = grid.cells.observed_ids()
        assert len(ids)
        assert np.array_equal(ids, np.flatnonzero(grid.cells.observed.flat))
