"""Filtered maps against the table of the paper, and with people and doors."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from slam.errors import InputError
from slam.maps.filtered import Filtered
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
    WALL,
    again,
    at,
    beams_seen,
    drive,
    h,
    integrated,
    readings,
    seen,
    value,
    watched,
)

sequences = st.lists(
    st.tuples(st.just(0.2), st.sampled_from([CLOSED, OPEN, OPEN, HIDDEN])), max_size=60
)


@given(sequences, st.sampled_from([0.02, 0.1]), st.sampled_from([1.5, 4.0]))
def test_a_cell_against_the_table(sequence, sure, limit) -> None:
    grid = Filtered(1.0, EVIDENCE, free_threshold=sure, limit=limit)
    watched(grid, *readings(sequence))
    expected = naive.filtered(beams_seen(readings(sequence)), sure, limit, **VALUES)
    for cell, (stays, moves) in expected.items():
        assert value(grid, grid.log_odds, cell) == pytest.approx(stays, abs=1e-4)
        assert value(grid, grid.moving, cell) == pytest.approx(moves, abs=1e-4)
        assert h(grid, cell) == pytest.approx(naive.sigmoid(stays), abs=1e-5)


@pytest.mark.parametrize("seed", range(3))
def test_a_drive_against_the_table(seed: int) -> None:
    history = again(drive(n=24, seed=seed), 40.0)
    grid = integrated(Filtered(0.05, EVIDENCE, RAYS, free_threshold=0.1), history)
    expected = naive.filtered(seen(history), 0.1, grid.limit, **VALUES)
    assert grid.cells.grid().observed.sum() == len(expected)
    dynamic = grid.dynamic()
    for cell, (stays, moves) in expected.items():
        assert value(grid, grid.log_odds, cell) == pytest.approx(stays, abs=1e-5)
        found = dynamic.occupied[at(grid.cells.tiles, cell)]
        assert found == pytest.approx(naive.sigmoid(moves), abs=1e-6)
    assert (dynamic.observed == grid.cells.grid().observed).all()


def test_somebody_who_walks_through_free_space_is_in_the_dynamic_grid_only() -> None:
    grid, static = Filtered(1.0), Static(1.0)
    for g in (grid, static):
        watched(g, *[(0.2 * k, OPEN) for k in range(30)])
        for k in range(12):  # a step back every three scans
            watched(g, (6 + 0.2 * k, 2.0 + k // 3))
    for col in range(2, 6):
        assert h(grid, (0, col)) < 0.05
    assert h(grid, WALL) > 0.95
    dynamic = grid.dynamic().occupied
    tiles = grid.cells.tiles
    assert dynamic[at(tiles, (0, 5))] > 0.8  # there they are now
    assert dynamic[at(tiles, (0, 3))] < 0.45  # and here they were before
    watched(grid, *[(9 + 0.2 * k, OPEN) for k in range(10)])
    assert (grid.dynamic().occupied <= naive.sigmoid(-1.3)).all()


def test_a_door_that_was_open_first_never_enters_the_static_grid() -> None:
    grid = Filtered(1.0)
    watched(grid, *[(0.2 * k, OPEN) for k in range(30)])
    assert max(watched(grid, *[(6 + 0.2 * k, CLOSED) for k in range(1000)])) < 0.05
    assert naive.sigmoid(value(grid, grid.moving, DOOR)) > 0.85


def test_a_door_that_was_closed_first_leaves_it_as_slowly_as_a_static_one() -> None:
    history = [(0.2 * k, CLOSED) for k in range(10)] + [(2 + 0.2 * k, OPEN) for k in range(30)]
    assert watched(Filtered(1.0), *history) == pytest.approx(watched(Static(1.0), *history))


@pytest.mark.parametrize(
    "wrong",
    [
        {"free_threshold": 0.0},
        {"free_threshold": 1.0},
        {"limit": 0.0},
        {"free_threshold": math.nan},
    ],
)
def test_thresholds_that_are_none_are_refused(wrong: dict) -> None:
    with pytest.raises(InputError, match=next(iter(wrong))):
        Filtered(**wrong)
