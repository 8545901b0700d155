"""HMM maps against chains simulated in small steps, and the rates learned of doors and walls."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slam.errors import InputError
from slam.maps.hmm import FREE, HMM, OCCUPIED, UNDECIDED
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
    scans_until,
    seen,
    value,
    watched,
)

gaps = st.sampled_from([0.0, 0.2, 1.0, 7.0, 400.0])
stretches = st.lists(
    st.tuples(gaps, st.sampled_from([CLOSED, OPEN, HIDDEN]), st.integers(1, 12)),
    min_size=1,
    max_size=12,
)
DECIDED = {None: UNDECIDED, 0: FREE, 1: OCCUPIED}


def rates(grid: HMM, cell=DOOR) -> tuple[float, float]:
    return grid.rates(*at(grid.cells.tiles, cell))


@settings(max_examples=40)
@given(stretches, st.sampled_from([(0.5, 60.0), (2.0, 10.0)]))
def test_a_cell_is_the_chain_of_the_reference(of, prior) -> None:
    sequence = readings([(gap, length) for gap, length, n in of for _ in range(n)])
    grid = HMM(1.0, EVIDENCE, changes=prior[0], dwell=prior[1])
    watched(grid, *sequence)
    for cell, chain in naive.hmm(beams_seen(sequence), *prior, **VALUES).items():
        if chain.margin > 2e-3:  # times are kept in float32
            assert h(grid, cell) == pytest.approx(chain.p, abs=2e-3)
            assert value(grid, grid.state, cell) == DECIDED[chain.state]
            assert rates(grid, cell) == pytest.approx(chain.rates, rel=2e-3)


@pytest.mark.parametrize("seed", range(3))
def test_a_drive_against_the_reference(seed: int) -> None:
    history = again(drive(n=16, seed=seed), 40.0)
    grid = integrated(HMM(0.05, EVIDENCE, RAYS), history)
    expected = naive.hmm(seen(history), grid.changes, grid.dwell, **VALUES)
    assert grid.cells.grid().observed.sum() == len(expected)
    for cell, chain in expected.items():
        assert h(grid, cell) == pytest.approx(chain.p, abs=1e-5)
        assert rates(grid, cell) == pytest.approx(chain.rates, rel=1e-4)


def flapping(seconds: float, dwell: float, step: float = 0.2) -> list[tuple[float, float]]:
    """A door that is closed for `dwell` s, then open for as long, and so on."""
    times = np.arange(round(seconds / step)) * step
    return [(t, OPEN if (t // dwell) % 2 else CLOSED) for t in times.tolist()]


@pytest.mark.parametrize("dwell", [5.0, 12.0, 30.0])
def test_the_rates_of_a_door_are_learned(dwell: float) -> None:
    grid = HMM(1.0)
    watched(grid, *flapping(1200.0, dwell))
    closing, opening = rates(grid)
    assert 1 / closing + 1 / opening == pytest.approx(2 * dwell, rel=0.1)
    assert 1 / closing == pytest.approx(dwell, abs=2)  # that it opened takes longer to notice


def test_each_direction_has_a_rate_of_its_own() -> None:
    grid = HMM(1.0)
    times = (np.arange(6000) * 0.2).tolist()
    watched(grid, *[(t, CLOSED if t % 40 < 10 else OPEN) for t in times])
    closing, opening = rates(grid)
    assert 1 / closing == pytest.approx(30, rel=0.2)
    assert 1 / opening == pytest.approx(10, rel=0.25)


def test_a_wall_hardly_ever_changes_and_neither_does_the_way_to_it() -> None:
    grid = HMM(1.0)
    watched(grid, *[(0.2 * k, OPEN) for k in range(5000)])
    assert rates(grid, WALL)[1] < 0.6 / 1000
    assert rates(grid, DOOR)[0] < 0.6 / 1000
    grid = HMM(1.0)  # and with beams that pass the wall, two of three
    watched(grid, *[(0.2 * k, OPEN + (k % 3 > 0) * 2.0) for k in range(5000)])
    assert rates(grid, WALL)[1] < 2 / 1000
    assert h(grid, WALL) > 0.5


def test_a_door_is_unlearned_faster_the_more_often_it_changed() -> None:
    wall, door = HMM(1.0), HMM(1.0)
    watched(wall, *[(0.2 * k, CLOSED) for k in range(2000)])
    watched(door, *flapping(400.0 - 5.0, 5.0), *[(395 + 0.2 * k, CLOSED) for k in range(25)])
    assert min(h(wall), h(door)) > 0.9
    waits = [scans_until(grid, OPEN, 400.0, 0.2, lambda h: h < 0.5) for grid in (door, wall)]
    assert waits[0] <= 10  # 2 s of passes, odds of e^4, for what changes every 5 s
    assert 18 <= waits[1] <= 40  # for what stood for 400 s; a static map takes 1500


def test_p_goes_to_the_share_of_time_while_nobody_looks() -> None:
    grid = HMM(1.0)
    watched(grid, *flapping(600.0, 10.0))
    closing, opening = rates(grid)
    share = closing / (closing + opening)
    last = h(grid)
    assert abs(last - share) > 0.4
    cell = at(grid.cells.tiles, DOOR)
    now = grid.predicted(599.8)
    assert now.occupied[cell] == pytest.approx(last, abs=1e-4)
    expected = [share + (last - share) * math.exp(-(closing + opening) * t) for t in (1, 5, 1000)]
    later = [grid.predicted(599.8 + t).occupied[cell] for t in (1, 5, 1000)]
    assert later == pytest.approx(expected, abs=1e-3)
    assert later[-1] == pytest.approx(share, abs=1e-6)
    assert h(grid) == last  # the map itself waits until it sees
    unseen = ~now.observed
    assert (now.occupied[unseen] == np.float32(0.2)).all()


def test_nothing_is_predicted_of_nothing() -> None:
    assert HMM().predicted(10.0).occupied.size == 0


def test_time_in_which_all_is_forgotten_teaches_nothing() -> None:
    grid = HMM(1.0)
    watched(grid, *flapping(600.0, 10.0))
    before = rates(grid)
    closing, opening = before
    long = 1.01 / (closing + opening)
    for k in range(1, 30):
        watched(grid, (599.8 + k * long, CLOSED))
    assert rates(grid) == before


def test_what_a_cell_was_first_is_no_change() -> None:
    grid = HMM(1.0)
    watched(grid, *[(0.2 * k, OPEN) for k in range(30)])
    assert value(grid, grid.state, DOOR) == FREE
    assert value(grid, grid.state, WALL) == OCCUPIED
    assert not grid.counts.values.any()
    watched(grid, *[(6 + 0.2 * k, CLOSED) for k in range(10)])
    assert value(grid, grid.state, DOOR) == OCCUPIED
    assert value(grid, grid.counts, DOOR).tolist() == [0, 1]
    watched(grid, *[(8 + 0.2 * k, OPEN) for k in range(40)])
    assert value(grid, grid.counts, DOOR).tolist() == [1, 1]


def test_counts_that_are_full_halve_and_the_rates_stay() -> None:
    grid = HMM(1.0)
    watched(grid, *flapping(2 * 260 * 5.0, 5.0))
    assert 120 < value(grid, grid.counts, DOOR).max() < 255
    assert sum(1 / rate for rate in rates(grid)) == pytest.approx(10, rel=0.05)


@pytest.mark.parametrize("wrong", [{"changes": 0.0}, {"dwell": 0.0}, {"dwell": math.inf}])
def test_a_prior_that_says_nothing_is_refused(wrong: dict) -> None:
    with pytest.raises(InputError, match=next(iter(wrong))):
        HMM(**wrong)
