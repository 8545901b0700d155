"""Static, clamped and histogram maps against their references, and by hand."""

import math

import numpy as np
import pytest

from slam.errors import InputError
from slam.geometry import Pose2
from slam.grid import GridSpec
from slam.maps.clamped import Clamped
from slam.maps.histogram import Histogram
from slam.maps.log_odds import Evidence
from slam.maps.rays import Rays
from slam.maps.static import Static
from tests.slam import naive
from tests.slam.worlds import ROOM, beam, loop, scan_at

MODELS = [Static, Clamped, Histogram]
RAYS = Rays(reach=3.0, no_echo_reach=1.0)
EVIDENCE = Evidence(hit=0.85, free=-0.4, prior=0.2)


def drive(n: int = 12, seed: int = 0):
    """(scan, pose) of a drive in which part of the room's walls come and go."""
    rng = np.random.default_rng(seed)
    result = []
    for k, pose in enumerate(loop(n)):
        walls = ROOM[rng.random(len(ROOM)) < 0.7]
        angles = np.sort(rng.uniform(-3, 3, 15))
        scan = scan_at(Pose2.of(pose), time=1.3 * k, angles=angles, walls=walls)
        result.append((scan, Pose2.of(pose)))
    return result


def integrated(grid, history):
    for scan, pose in history:
        grid.integrate(scan, pose)
    return grid


def seen(history):
    return [(s.time, naive.seen(s, p, 0.05, RAYS.reach, RAYS.no_echo_reach)) for s, p in history]


def at(spec: GridSpec, cell: tuple[int, int]) -> tuple[int, int]:
    return cell[0] - spec.row0, cell[1] - spec.col0


@pytest.mark.parametrize("limit", [math.inf, 1.0])
@pytest.mark.parametrize("seed", range(3))
def test_static_and_clamped_are_sums_of_log_odds(limit: float, seed: int) -> None:
    history = drive(seed=seed)
    grid = integrated(Static(evidence=EVIDENCE, rays=RAYS, limit=limit), history)
    expected = naive.static(seen(history), limit=limit)
    assert grid.observed.sum() == len(expected)
    for cell, log_odds in expected.items():
        assert grid.log_odds[at(grid.spec, cell)] == pytest.approx(log_odds, abs=1e-5)
        h = 1 / (1 + math.exp(-log_odds))
        assert grid.occupied[at(grid.spec, cell)] == pytest.approx(h, abs=1e-6)
    assert (grid.occupied[~grid.observed] == np.float32(0.2)).all()


@pytest.mark.parametrize("bins", [2, 10])
@pytest.mark.parametrize("seed", range(3))
def test_a_histogram_keeps_what_the_full_history_keeps(bins: int, seed: int) -> None:
    history = drive(seed=seed)
    history += [(scan_at(pose, time=200 + s.time), pose) for s, pose in history[:4]]
    grid = integrated(Histogram(0.05, EVIDENCE, RAYS, delta_t=3.0, bins=bins), history)
    expected = naive.temporal(seen(history), 3.0, bins)
    assert grid.observed.sum() == len(expected)
    for cell, (h, histogram) in expected.items():
        assert grid.histogram(*at(grid.spec, cell)).tolist() == histogram
        assert grid.occupied[at(grid.spec, cell)] == pytest.approx(h, abs=1e-6)
    assert (grid.occupied[~grid.observed] == np.float32(0.2)).all()
    unseen = np.argwhere(~grid.observed)[0]
    assert not grid.histogram(*unseen).any()


@pytest.mark.parametrize("model", MODELS)
def test_centroids_are_those_of_all_echoes(model) -> None:
    history = drive()
    grid = integrated(model(), history)
    expected = naive.centroids(history, 0.05)
    assert np.count_nonzero(grid.centroids.count) == len(expected)
    for cell, offset in expected.items():
        found = grid.centroids.offset[at(grid.spec, cell)]
        np.testing.assert_allclose(found, offset, atol=1e-6)


@pytest.mark.parametrize("model", MODELS)
def test_changed_cells_are_those_seen(model) -> None:
    grid = model()
    for scan, pose in drive(6):
        before, old = grid.occupied, grid.spec
        changed = grid.integrate(scan, pose)
        cells = np.column_stack(np.divmod(changed, grid.spec.cols))
        lattice = {tuple(c) for c in (cells + (grid.spec.row0, grid.spec.col0)).tolist()}
        assert lattice == set(naive.seen(scan, pose, 0.05))
        if old == grid.spec:
            assert set(np.flatnonzero(before != grid.occupied)) <= set(changed)


@pytest.mark.parametrize("model", MODELS)
def test_growing_in_all_directions_equals_starting_large(model) -> None:
    far = [Pose2(3.0 * x, 3.0 * y, 1.0 * k) for k, (x, y) in
           enumerate([(0, 0), (1, 0), (0, 1), (-1, 0), (0, -1), (0, 0)])]  # fmt: skip
    history = [(scan_at(Pose2(0.1, 0.1), time=k), pose) for k, pose in enumerate(far)]
    growing, large = model(), model()
    large._grow(GridSpec.around((-12, -12), (12, 12), 0.05))
    integrated(growing, history)
    integrated(large, history)
    spec = growing.spec
    assert spec.row0 < 0 < spec.row0 + spec.rows
    assert spec != large.spec
    row, col = at(large.spec, (spec.row0, spec.col0))
    window = np.s_[row : row + spec.rows, col : col + spec.cols]
    for name in ("occupied", "observed"):
        np.testing.assert_array_equal(getattr(growing, name), getattr(large, name)[window])
    np.testing.assert_array_equal(growing.centroids.offset, large.centroids.offset[window])
    np.testing.assert_array_equal(growing.centroids.count, large.centroids.count[window])
    assert large.observed.sum() == growing.observed.sum()


def test_static_and_histogram_agree_where_nothing_changes() -> None:
    poses = [Pose2.of(pose) for pose in loop(5)]
    history = [(scan_at(pose), pose) for pose in poses]
    history = [
        (scan_at(pose, time=float(5 * k + n)), pose)
        for k, (_, pose) in enumerate(history)
        for n in range(4)
    ]
    static, histogram = integrated(Static(), history), integrated(Histogram(), history)
    np.testing.assert_array_equal(static.observed, histogram.observed)
    apart = (static.occupied > 0.5) != (histogram.occupied > 0.5)
    assert (static.occupied > 0.5).sum() > 100
    assert apart.sum() < 0.01 * static.observed.sum()


# A robot in the cell (0, 0) of a 1 m grid looks along x at a door in the cell (0, 3); a wall
# stands behind it in (0, 6). What h of the door must be is worked out by hand.
ROBOT, DOOR, WALL = Pose2(0.5, 0.5), (0, 3), (0, 6)
CLOSED, OPEN = 3.0, 6.0


def watched(grid, *readings: tuple[float, float]):
    """h of the door's cell after each of the readings (time, range)."""
    result = []
    for time, length in readings:
        grid.integrate(beam(length, time), ROBOT)
        result.append(float(grid.occupied[DOOR]))
    return result


def test_a_door_by_hand_static() -> None:
    found = watched(Static(1.0, EVIDENCE), (0, CLOSED), (1, CLOSED), (2, OPEN))
    # log-odds ln(0.2 / 0.8) = -1.3863, + 0.85, + 0.85, - 0.4
    assert found == pytest.approx([0.3691, 0.5778, 0.4784], abs=1e-4)


def test_the_other_cells_by_hand() -> None:
    grid = Static(1.0, EVIDENCE)
    watched(grid, (0, CLOSED), (1, OPEN))
    log_odds = [grid.log_odds[0, col] for col in range(8)]
    expected = np.array([-0.8, -0.8, -0.8, 0.45, -0.4, -0.4, 0.85, 0.0]) - math.log(4)
    np.testing.assert_allclose(log_odds, expected, atol=1e-6)
    assert grid.observed[0, :8].tolist() == [True] * 7 + [False]


def test_a_door_by_hand_histogram_of_two_bins() -> None:
    grid = Histogram(1.0, EVIDENCE, delta_t=10.0, bins=2)
    found = watched(grid, (0, CLOSED), (9, CLOSED), (10, OPEN), (25, CLOSED), (26, CLOSED))
    # a window takes two hits, as -1.3863 + 0.85 is below zero: 0 | 1 | 1, 0 | 1, 0, 0 | 1, 0, 1;
    # and the prior, 0.2, counts as a tenth of a window
    expected = [0.02 / 1.1, 1.02 / 1.1, 1.02 / 2.1, 1.02 / 3.1, 2.02 / 3.1]
    assert found == pytest.approx(expected, abs=1e-6)
    assert grid.histogram(*DOOR).tolist() == [1, 2]


def test_a_door_by_hand_histogram_of_ten_bins() -> None:
    grid = Histogram(1.0, EVIDENCE, delta_t=10.0, bins=10)
    found = watched(grid, (0, CLOSED), (1, CLOSED), (12, OPEN))
    # the static map's 0.369: bin 3; 0.578: bin 5; and sigma(-1.3863 - 0.4) = 0.144: bin 1
    expected = [(3 / 9 + 0.02) / 1.1, (5 / 9 + 0.02) / 1.1, (5 / 9 + 1 / 9 + 0.02) / 2.1]
    assert found == pytest.approx(expected, abs=1e-6)
    assert grid.histogram(*DOOR).tolist() == [0, 1, 0, 0, 0, 1, 0, 0, 0, 0]


def test_windows_in_which_a_cell_was_not_seen_do_not_count() -> None:
    grid = Histogram(1.0, EVIDENCE, delta_t=10.0, bins=2)
    readings = (0, CLOSED), (1, CLOSED), (10, 1.0), (20, 1.0), (35, CLOSED), (36, CLOSED)
    assert watched(grid, *readings)[-1] == pytest.approx(2.02 / 2.1)
    assert grid.histogram(*DOOR).tolist() == [0, 2]


def test_a_window_with_a_single_hit_counts_as_occupied_by_default() -> None:
    found = watched(Histogram(1.0, bins=2), (0, CLOSED))
    assert found == pytest.approx([1.02 / 1.1])


def scans_until_free(grid, closed_for: int) -> int:
    """How many scans through the open door it takes until its log-odds are below zero."""
    watched(grid, *[(k, CLOSED) for k in range(closed_for)])
    for n in range(1, 1000):
        grid.integrate(beam(OPEN, closed_for + n), ROBOT)
        if grid.log_odds[DOOR] < 0:
            return n
    raise AssertionError("never")


def test_static_needs_as_long_to_forget_as_it_saw_and_clamped_does_not() -> None:
    # static: (closed_for x 0.85 - 1.386) / 0.4, rounded up; clamped to 2.1: 2.1 / 0.4, so 6
    assert [scans_until_free(Static(1.0, EVIDENCE), n) for n in (2, 10, 100)] == [1, 18, 210]
    clamped = [scans_until_free(Clamped(1.0, EVIDENCE, limit=2.1), n) for n in (2, 10, 100)]
    assert clamped == [1, 6, 6]


def test_clamped_is_clamped_below_too() -> None:
    grid = Clamped(1.0, Evidence(0.85, -0.4, prior=0.5), limit=1.5)
    found = watched(grid, *[(k, OPEN) for k in range(50)], (50, CLOSED), (51, CLOSED))
    assert found[49] == pytest.approx(1 / (1 + math.exp(1.5)), abs=1e-6)
    assert found[-1] == pytest.approx(1 / (1 + math.exp(-0.2)), abs=1e-6)


@pytest.mark.parametrize("wrong", [{"delta_t": 0.0}, {"bins": 1}, {"weight": 0.0}])
def test_a_histogram_without_windows_bins_or_prior_is_refused(wrong: dict) -> None:
    with pytest.raises(InputError, match=next(iter(wrong))):
        Histogram(**wrong)


@pytest.mark.parametrize("start", [-1.0, 1.8e9])
def test_windows_are_told_apart_on_any_clock(start: float) -> None:
    grid = Histogram(1.0, EVIDENCE, delta_t=0.5, bins=2)
    times = [start + 0.1 * k for k in range(1, 4)] + [start + 0.6]
    watched(grid, *[(time, CLOSED) for time in times], (start + 0.7, OPEN))
    assert grid.histogram(*DOOR).tolist() == [1, 1]


@pytest.mark.parametrize("model", MODELS)
def test_an_echo_on_the_border_of_two_cells_counts_in_the_one_that_was_hit(model) -> None:
    grid = model(evidence=EVIDENCE)
    grid.integrate(beam(1.0), Pose2(-0.2, -0.2))
    for k in range(1, 60):
        changed = grid.integrate(beam(0.05 * k, 10.0 * k), Pose2(0.0, 0.025))
        counted = np.flatnonzero(grid.centroids.count)
        assert changed.max() in counted
