"""Hybrid maps against the static map and the full history."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from slam.errors import InputError
from slam.maps.histogram import Histogram
from slam.maps.hybrid import Hybrid
from slam.maps.static import Static
from tests.slam import naive
from tests.slam.maps.driving import (
    CLOSED,
    DOOR,
    EVIDENCE,
    HIDDEN,
    OPEN,
    RAYS,
    VALUES,
    again,
    beams_seen,
    drive,
    h,
    integrated,
    readings,
    seen,
    value,
    watched,
)

gaps = st.sampled_from([0.0, 0.3, 1.1, 4.0, 50.0])
sequences = st.lists(
    st.tuples(gaps, st.sampled_from([CLOSED, OPEN, HIDDEN])), min_size=1, max_size=60
)


@given(sequences, st.sampled_from([2, 5, 10]), st.sampled_from([0.5, 3.0]))
def test_a_cell_is_the_larger_of_static_map_and_mean(sequence, bins, delta_t) -> None:
    grid = Hybrid(1.0, EVIDENCE, delta_t=delta_t, bins=bins)
    watched(grid, *readings(sequence))
    expected = naive.hybrid(beams_seen(readings(sequence)), delta_t, bins, **VALUES)
    for cell, larger in expected.items():
        assert h(grid, cell) == pytest.approx(larger, abs=1e-5)


@pytest.mark.parametrize("seed", range(3))
def test_a_drive_against_the_reference(seed: int) -> None:
    history = again(drive(n=24, seed=seed), 40.0)
    grid = integrated(Hybrid(0.05, EVIDENCE, RAYS, delta_t=3.0), history)
    expected = naive.hybrid(seen(history), 3.0, 10, **VALUES)
    assert grid.cells.grid().observed.sum() == len(expected)
    for cell, larger in expected.items():
        assert h(grid, cell) == pytest.approx(larger, abs=1e-5)


def test_a_door_that_came_back_is_remembered_while_it_is_away() -> None:
    history = [(float(k), CLOSED if k // 10 in (1, 3) else OPEN) for k in range(60)]
    grids = Hybrid(1.0, delta_t=10.0), Histogram(1.0, delta_t=10.0), Static(1.0)
    hybrid, histogram, static = (watched(grid, *history) for grid in grids)
    assert hybrid[:30] == pytest.approx(static[:30])  # occupied in one window only
    assert hybrid[35] == static[35] > histogram[35]
    watched(grids[0], *[(60.0 + k, OPEN) for k in range(40)])
    watched(grids[1], *[(60.0 + k, OPEN) for k in range(40)])
    watched(grids[2], *[(60.0 + k, OPEN) for k in range(40)])
    assert h(grids[0]) == h(grids[1]) > 0.15
    assert h(grids[2]) < 0.05


def test_the_open_window_is_one_in_which_a_door_may_be_back() -> None:
    away = [(float(k), CLOSED) for k in range(10)] + [(float(k), OPEN) for k in range(100, 200)]
    hybrid, static = Hybrid(1.0, delta_t=100.0), Static(1.0)
    assert watched(hybrid, *away)[-1] < 0.01
    watched(static, *away)
    found = watched(hybrid, (200.0, CLOSED), (201.0, CLOSED))
    assert found[-1] > 0.4  # of three windows, in one of which it was away
    assert watched(static, (200.0, CLOSED), (201.0, CLOSED))[-1] < 0.01


def test_windows_that_are_full_halve_and_the_mean_stays() -> None:
    grid = Hybrid(1.0, EVIDENCE, delta_t=1.0, bins=2)
    history = [(0.5 * k, CLOSED if k % 8 < 2 else OPEN) for k in range(2 * 256)]
    watched(grid, *history)
    assert value(grid, grid.closed_windows, DOOR) == 255
    before = int(value(grid, grid.bin_sum, DOOR))
    assert before == value(grid, grid.occupied_windows, DOOR) == 64
    watched(grid, (256.0, OPEN))
    assert value(grid, grid.closed_windows, DOOR) == 129
    assert value(grid, grid.bin_sum, DOOR) == value(grid, grid.occupied_windows, DOOR) == 32
    assert h(grid) == pytest.approx((32 + 0.023) / 130.1)


def test_the_same_as_the_full_history_until_then() -> None:
    history = [(0.5 * k, CLOSED if k % 8 < 2 else OPEN) for k in range(2 * 256)]
    grid = Hybrid(1.0, EVIDENCE, delta_t=1.0)
    assert watched(grid, *history)[-1] == pytest.approx(
        naive.hybrid(beams_seen(history), 1.0, 10, **VALUES)[DOOR], abs=1e-6
    )


@pytest.mark.parametrize("wrong", [{"delta_t": 0.0}, {"bins": 1}, {"weight": 0.0}])
def test_a_map_without_windows_bins_or_prior_is_refused(wrong: dict) -> None:
    with pytest.raises(InputError, match=next(iter(wrong))):
        Hybrid(**wrong)
