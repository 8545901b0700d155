"""Static and clamped maps against their references, and by hand."""

import math
from dataclasses import replace

import numpy as np
import pytest

from slam.errors import InputError
from slam.geometry import Pose2
from slam.maps.clamped import Clamped
from slam.maps.log_odds import Evidence
from slam.maps.static import NO_DOUBT, Static
from slam.scan import Scan
from tests.slam import naive
from tests.slam.maps.driving import (
    CLOSED,
    DOOR,
    EVIDENCE,
    OPEN,
    RAYS,
    VALUES,
    drive,
    h,
    integrated,
    scans_until,
    seen,
    value,
    watched,
)

BY_HAND = Evidence(hit=0.85, free=-0.4, prior=0.2)


@pytest.mark.parametrize("limit", [math.inf, 1.0])
@pytest.mark.parametrize("seed", range(3))
def test_static_and_clamped_are_sums_of_log_odds(limit: float, seed: int) -> None:
    history = drive(seed=seed)
    grid = integrated(Static(evidence=EVIDENCE, rays=RAYS, limit=limit), history)
    expected = naive.static(seen(history), limit=limit, **VALUES)
    assert grid.cells.grid().observed.sum() == len(expected)
    for cell, log_odds in expected.items():
        assert value(grid, grid.log_odds, cell) == pytest.approx(log_odds, abs=1e-5)
        assert h(grid, cell) == pytest.approx(naive.sigmoid(log_odds), abs=1e-6)


def test_a_door_by_hand() -> None:
    found = watched(Static(1.0, BY_HAND), (0, CLOSED), (1, CLOSED), (2, OPEN))
    # log-odds ln(0.2 / 0.8) = -1.3863, + 0.85, + 0.85, - 0.4
    assert found == pytest.approx([0.3691, 0.5778, 0.4784], abs=1e-4)


def test_the_other_cells_by_hand() -> None:
    grid = Static(1.0, BY_HAND)
    watched(grid, (0, CLOSED), (1, OPEN))
    log_odds = [value(grid, grid.log_odds, (0, col)) for col in range(8)]
    expected = np.array([-0.8, -0.8, -0.8, 0.45, -0.4, -0.4, 0.85, 0.0]) - math.log(4)
    np.testing.assert_allclose(log_odds, expected, atol=1e-6)
    observed = [bool(value(grid, grid.cells.observed, (0, col))) for col in range(8)]
    assert observed == [True] * 7 + [False]


def scans_until_free(grid, closed_for: int) -> int:
    watched(grid, *[(k, CLOSED) for k in range(closed_for)])
    return scans_until(grid, OPEN, closed_for, 1.0, lambda h: h < 0.5)


def test_static_needs_as_long_to_forget_as_it_saw_and_clamped_does_not() -> None:
    # static: (closed_for x 0.85 - 1.386) / 0.4, rounded up; clamped to 2.1: 2.1 / 0.4, so 6
    assert [scans_until_free(Static(1.0, BY_HAND), n) for n in (2, 10, 100)] == [1, 18, 210]
    clamped = [scans_until_free(Clamped(1.0, BY_HAND, limit=2.1), n) for n in (2, 10, 100)]
    assert clamped == [1, 6, 6]


def test_clamped_is_clamped_below_too() -> None:
    grid = Clamped(1.0, Evidence(0.85, -0.4, prior=0.5), limit=1.5)
    found = watched(grid, *[(k, OPEN) for k in range(50)], (50, CLOSED), (51, CLOSED))
    assert found[49] == pytest.approx(1 / (1 + math.exp(1.5)), abs=1e-6)
    assert found[-1] == pytest.approx(1 / (1 + math.exp(-0.2)), abs=1e-6)


def test_static_is_clamped_nowhere() -> None:
    grid = Static(1.0, EVIDENCE)
    watched(grid, *[(k, CLOSED) for k in range(1000)])
    assert value(grid, grid.log_odds, DOOR) == pytest.approx(850 - math.log(0.77 / 0.23), abs=0.1)


@pytest.mark.parametrize("limit", [0.0, -1.0, math.nan])
def test_a_limit_that_leaves_nothing_is_refused(limit: float) -> None:
    with pytest.raises(InputError, match="limit"):
        Clamped(limit=limit)


def test_h_of_an_echo_in_a_cell_that_was_free_without_a_doubt() -> None:
    grid, wall = Static(), Scan(np.full(9, 4.0), np.linspace(-0.2, 0.2, 9), 10.0)
    for _ in range(80):
        grid.integrate(wall, Pose2())
    box = replace(wall, ranges=np.full(9, 2.0))
    grid.integrate(box, Pose2())
    log_odds, h = grid.log_odds.flat.astype(np.float64), grid.cells.occupied.flat
    hit = (grid.cells.centroids.count.flat > 0) & (log_odds < NO_DOUBT)
    assert hit.sum() > 5
    np.testing.assert_allclose(h[hit], np.exp(log_odds[hit]), rtol=1e-5)
