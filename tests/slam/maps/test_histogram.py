"""Histogram maps against the full history, and by hand."""

import numpy as np
import pytest

from slam.errors import InputError
from slam.maps.histogram import Histogram
from slam.maps.log_odds import Evidence
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
    seen,
    watched,
)

BY_HAND = Evidence(hit=0.85, free=-0.4, prior=0.2)


def histogram(grid: Histogram, cell=DOOR) -> list[int]:
    return grid.histogram(*at(grid.cells.tiles, cell)).tolist()


@pytest.mark.parametrize("bins", [2, 10])
@pytest.mark.parametrize("seed", range(3))
def test_a_histogram_keeps_what_the_full_history_keeps(bins: int, seed: int) -> None:
    history = again(drive(seed=seed), 200.0)
    grid = integrated(Histogram(0.05, EVIDENCE, RAYS, delta_t=3.0, bins=bins), history)
    expected = naive.temporal(seen(history), 3.0, bins, **VALUES)
    assert grid.cells.grid().observed.sum() == len(expected)
    for cell, (mean, counts) in expected.items():
        assert histogram(grid, cell) == counts
        assert h(grid, cell) == pytest.approx(mean, abs=1e-6)
    unseen = np.argwhere(~grid.cells.grid().observed)[0]
    assert not grid.histogram(*unseen).any()


def test_a_door_by_hand_of_two_bins() -> None:
    grid = Histogram(1.0, BY_HAND, delta_t=10.0, bins=2)
    found = watched(grid, (0, CLOSED), (9, CLOSED), (10, OPEN), (25, CLOSED), (26, CLOSED))
    # a window takes two hits, as -1.3863 + 0.85 is below zero: 0 | 1 | 1, 0 | 1, 0, 0 | 1, 0, 1;
    # and the prior, 0.2, counts as a tenth of a window
    expected = [0.02 / 1.1, 1.02 / 1.1, 1.02 / 2.1, 1.02 / 3.1, 2.02 / 3.1]
    assert found == pytest.approx(expected, abs=1e-6)
    assert histogram(grid) == [1, 2]


def test_a_door_by_hand_of_ten_bins() -> None:
    grid = Histogram(1.0, BY_HAND, delta_t=10.0, bins=10)
    found = watched(grid, (0, CLOSED), (1, CLOSED), (12, OPEN))
    # the static map's 0.369: bin 3; 0.578: bin 5; and sigma(-1.3863 - 0.4) = 0.144: bin 1
    expected = [(3 / 9 + 0.02) / 1.1, (5 / 9 + 0.02) / 1.1, (5 / 9 + 1 / 9 + 0.02) / 2.1]
    assert found == pytest.approx(expected, abs=1e-6)
    assert histogram(grid) == [0, 1, 0, 0, 0, 1, 0, 0, 0, 0]


def test_windows_in_which_a_cell_was_not_seen_do_not_count() -> None:
    grid = Histogram(1.0, BY_HAND, delta_t=10.0, bins=2)
    readings = (0, CLOSED), (1, CLOSED), (10, HIDDEN), (20, HIDDEN), (35, CLOSED), (36, CLOSED)
    assert watched(grid, *readings)[-1] == pytest.approx(2.02 / 2.1)
    assert histogram(grid) == [0, 2]


def test_a_window_with_a_single_hit_counts_as_occupied_by_default() -> None:
    found = watched(Histogram(1.0, bins=2), (0, CLOSED))
    assert found == pytest.approx([1.02 / 1.1])


def test_the_mean_of_a_door_is_its_share_of_windows() -> None:
    grid = Histogram(1.0, delta_t=1.0, bins=2)
    watched(grid, *[(k, CLOSED if k % 4 else OPEN) for k in range(200)])
    assert h(grid) == pytest.approx(0.75, abs=0.01)


def test_a_full_bin_halves_them_all() -> None:
    grid = Histogram(1.0, delta_t=1.0, bins=2)
    watched(grid, *[(k, OPEN) for k in range(101)], *[(101 + k, CLOSED) for k in range(256)])
    assert histogram(grid) == [101, 256]
    watched(grid, (357, CLOSED))  # 101 and 255 closed windows, halved, one more, and the open one
    assert histogram(grid) == [51, 130]
    assert h(grid) == pytest.approx((130 + 0.02) / 181.1, abs=1e-6)


@pytest.mark.parametrize("wrong", [{"delta_t": 0.0}, {"bins": 1}, {"weight": 0.0}])
def test_a_histogram_without_windows_bins_or_prior_is_refused(wrong: dict) -> None:
    with pytest.raises(InputError, match=next(iter(wrong))):
        Histogram(**wrong)


@pytest.mark.parametrize("start", [-1.0, 1.8e9])
def test_windows_are_told_apart_on_any_clock(start: float) -> None:
    grid = Histogram(1.0, BY_HAND, delta_t=0.5, bins=2)
    times = [start + 0.1 * k for k in range(1, 4)] + [start + 0.61]
    watched(grid, *[(time, CLOSED) for time in times], (start + 0.7, OPEN))
    assert histogram(grid) == [1, 1]
