"""The mean map against the histogram that it is the mean of."""

import numpy as np
import pytest

from slam.errors import InputError
from slam.maps.histogram import Histogram
from slam.maps.mean import WINDOW_NUMBERS, Mean
from slam.maps.windowed import MAX_WINDOWS
from tests.slam.maps.driving import (
    CLOSED,
    DOOR,
    EVIDENCE,
    OPEN,
    RAYS,
    again,
    drive,
    h,
    integrated,
    value,
    watched,
)


@pytest.mark.parametrize("bins", [2, 10])
@pytest.mark.parametrize("seed", range(3))
def test_its_h_and_what_changed_are_the_histograms(bins: int, seed: int) -> None:
    mean, histogram = (model(0.05, EVIDENCE, RAYS, delta_t=3.0, bins=bins)
                       for model in (Mean, Histogram))  # fmt: skip
    for scan, pose in again(drive(seed=seed), 200.0):
        np.testing.assert_array_equal(mean.integrate(scan, pose), histogram.integrate(scan, pose))
    np.testing.assert_array_equal(mean.cells.grid().occupied, histogram.cells.grid().occupied)


def test_more_windows_than_are_counted_fade() -> None:
    grid = Mean(1.0, delta_t=1.0)
    watched(grid, *((float(t), CLOSED) for t in range(MAX_WINDOWS + 1)))
    assert value(grid, grid.closed_windows, DOOR) == MAX_WINDOWS
    full = h(grid)
    watched(grid, (float(MAX_WINDOWS + 1), OPEN))
    assert value(grid, grid.closed_windows, DOOR) == (MAX_WINDOWS + 1) // 2 + 1
    assert h(grid) == pytest.approx(full, abs=0.02)


def test_numbers_of_windows_begin_anew() -> None:
    grid = Mean(1.0, delta_t=1.0)
    watched(
        grid,
        (0.0, CLOSED),
        (float(WINDOW_NUMBERS - 1), CLOSED),
        (float(WINDOW_NUMBERS + 1), CLOSED),
    )
    assert value(grid, grid.window, DOOR) == 2
    assert value(grid, grid.closed_windows, DOOR) == 2


def test_less_memory_than_the_histogram() -> None:
    mean, histogram = (integrated(model(), drive()).cells.tiles.nbytes
                       for model in (Mean, Histogram))  # fmt: skip
    assert mean < 0.7 * histogram


@pytest.mark.parametrize("wrong", [{"delta_t": 0.0}, {"bins": 1}, {"weight": 0.0}])
def test_parameters_are_checked(wrong) -> None:
    with pytest.raises(InputError):
        Mean(**wrong)
