"""The temporal map equals the histogram map, and keeps the history."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slam.errors import InputError
from slam.maps.histogram import Histogram
from slam.maps.temporal import Temporal
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
    at,
    drive,
    h,
    integrated,
    readings,
    seen,
    value,
    watched,
)

gaps = st.sampled_from([0.0, 0.3, 1.1, 4.0, 50.0, -0.6, -7.0])
sequences = st.lists(st.tuples(gaps, st.sampled_from([CLOSED, OPEN, HIDDEN])), max_size=60)


@given(sequences, st.integers(2, 12), st.floats(0.05, 2.0), st.sampled_from([0.5, 3.0]))
def test_a_door_is_that_of_the_histogram_to_the_last_bit(sequence, bins, weight, delta_t) -> None:
    arguments = {"delta_t": delta_t, "bins": bins, "weight": weight}
    grids = Temporal(1.0, EVIDENCE, **arguments), Histogram(1.0, EVIDENCE, **arguments)
    assert watched(grids[0], *readings(sequence)) == watched(grids[1], *readings(sequence))


@settings(max_examples=20)
@given(st.integers(0, 10_000), st.sampled_from([2, 5, 10]), st.sampled_from([1.0, 3.0, 8.0]))
def test_a_drive_is_that_of_the_histogram_to_the_last_bit(seed, bins, delta_t) -> None:
    history = again(drive(seed=seed), 90.0)
    temporal, histogram = (
        integrated(m(0.05, EVIDENCE, RAYS, delta_t=delta_t, bins=bins), history).cells.grid()
        for m in (Temporal, Histogram)
    )
    np.testing.assert_array_equal(temporal.occupied, histogram.occupied)
    np.testing.assert_array_equal(temporal.observed, histogram.observed)


def test_equal_up_to_255_windows_in_a_bin_and_then_only_one_forgets() -> None:
    temporal, histogram = Temporal(1.0, delta_t=1.0, bins=2), Histogram(1.0, delta_t=1.0, bins=2)
    before = [(k, OPEN) for k in range(101)] + [(101 + k, CLOSED) for k in range(256)]
    assert watched(temporal, *before) == watched(histogram, *before)
    assert watched(temporal, (357, CLOSED)) != watched(histogram, (357, CLOSED))
    assert h(temporal) == pytest.approx((257 + 0.02) / 358.1)


@pytest.mark.parametrize("seed", range(3))
def test_every_window_of_every_cell_can_be_asked(seed: int) -> None:
    history = again(drive(seed=seed), 200.0)
    grid = integrated(Temporal(0.05, EVIDENCE, RAYS, delta_t=3.0), history)
    expected = naive.windows(seen(history), 3.0, **VALUES)
    tiles = grid.cells.tiles
    for cell, windows in expected.items():
        numbers, occupancy = grid.history(*at(tiles, cell))
        assert numbers.tolist() == list(windows)
        probabilities = [naive.sigmoid(log_odds) for log_odds in windows.values()]
        assert occupancy == pytest.approx(probabilities, abs=1e-6)
    all_numbers = sorted({number for windows in expected.values() for number in windows})
    assert grid.window_at(history[-1][0].time) == all_numbers[-1]
    for number in [*all_numbers, 1000]:
        then = grid.grid_of(number)
        of_it = {cell: w[number] for cell, w in expected.items() if number in w}
        assert then.spec == tiles.spec
        assert then.observed.sum() == len(of_it)
        for cell, log_odds in of_it.items():
            assert then.observed[at(tiles, cell)]
            assert then.occupied[at(tiles, cell)] == pytest.approx(naive.sigmoid(log_odds))
        np.testing.assert_allclose(then.occupied[~then.observed], 0.23, atol=1e-7)


def test_a_cell_that_was_never_seen_has_no_history() -> None:
    grid = Temporal(1.0)
    watched(grid, (0, CLOSED))
    for cell in ((20, 20), (0, 5)):
        windows, occupancy = grid.history(*at(grid.cells.tiles, cell))
        assert windows.tolist() == occupancy.tolist() == []


def test_of_a_window_opened_twice_the_map_shows_the_later() -> None:
    grid = Temporal(1.0, EVIDENCE, delta_t=10.0)
    watched(grid, (0, CLOSED), (1, CLOSED), (12, OPEN), (3, OPEN))
    windows, occupancy = grid.history(*at(grid.cells.tiles, DOOR))
    assert windows.tolist() == [0, 1, 0]
    then = grid.grid_of(0).occupied[at(grid.cells.tiles, DOOR)]
    assert then == pytest.approx(occupancy[2])
    assert occupancy[2] < 0.2 < 0.5 < occupancy[0]


def test_memory_grows_with_the_windows_and_says_so() -> None:
    grid = Temporal(1.0, delta_t=1.0)
    watched(grid, (0, CLOSED))
    tiles, first = grid.cells.tiles.nbytes, grid.nbytes
    assert first == tiles + 4 * 16  # four cells, one window each
    watched(grid, (0.2, CLOSED), (0.9, CLOSED))
    assert grid.nbytes == first
    watched(grid, *[(k, CLOSED) for k in range(1, 1000)])
    assert grid.nbytes == tiles + 1000 * 4 * 16
    assert grid.cells.tiles.nbytes == tiles
    assert value(grid, grid.closed_windows, DOOR) == 999


@pytest.mark.parametrize("wrong", [{"delta_t": 0.0}, {"bins": 1}, {"weight": 0.0}])
def test_a_map_without_windows_bins_or_prior_is_refused(wrong: dict) -> None:
    with pytest.raises(InputError, match=next(iter(wrong))):
        Temporal(**wrong)
