from collections import Counter

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slam.io.monotonic_times import TICK, monotonic

FORWARD = "time runs backwards, stamp moved forward"
STILL = "time stands still, stamp moved forward"
AHEAD = "time stamp leaps ahead, moved back"
SET_BACK = "clock set back, its times shifted from there on"


def steadied(times: np.ndarray) -> tuple[np.ndarray, Counter[str]]:
    told: Counter[str] = Counter()
    alone = np.zeros(len(times), dtype=bool)
    return monotonic(times, alone, lambda _, kind: told.update([kind])), told


def clock(n: int = 1000) -> np.ndarray:
    """Ten stamps a second of an uneven clock."""
    return 1e9 + 0.1 * np.arange(n) + np.random.default_rng(0).uniform(0, 0.05, n)


@pytest.mark.parametrize("back", [11.0, 30.0, 3600.0, 1e9])
def test_a_clock_set_back_keeps_its_differences(back: float) -> None:
    right = clock()
    times = right.copy()
    times[500:] -= back
    result, told = steadied(times)
    assert told == {SET_BACK: 1}
    assert (result[:500] == right[:500]).all()
    assert np.diff(result[500:]) == pytest.approx(np.diff(right[500:]), abs=1e-6)
    assert result[500] - result[499] == pytest.approx(0.1, abs=0.01)


def test_each_step_back_is_told_once() -> None:
    times = clock()
    times[300:] -= 3600
    times[600:] -= 3600
    result, told = steadied(times)
    assert told == {SET_BACK: 2}
    assert result == pytest.approx(clock(), abs=0.2)


def test_a_clock_that_is_put_right_again_is_followed_again() -> None:
    times = clock()
    times[300:600] -= 3600
    result, told = steadied(times)
    assert told[SET_BACK] == 1
    assert result[602:] == pytest.approx(clock()[602:], abs=1e-9)
    assert result == pytest.approx(clock(), abs=0.2)


@pytest.mark.parametrize("back", [0.5, 0.9, 5.0])
def test_after_a_glitch_the_stamps_are_the_logs_own(back: float) -> None:
    right = clock()
    times = right.copy()
    times[500:503] -= back
    result, told = steadied(times)
    assert told == {FORWARD: 3}
    assert np.delete(result, range(500, 503)) == pytest.approx(np.delete(right, range(500, 503)))
    assert result[500:503] == pytest.approx(right[499] + TICK * np.array([1, 2, 3]), abs=3e-7)


@pytest.mark.parametrize(
    ("at", "off"),  # a wrong start before a gap, and a gap before a wrong end, cannot be told
    [(0, 1e4), *((at, off) for at in (1, 2, 500, 997) for off in (1e4, -1e4))],
)
@pytest.mark.parametrize("run", [1, 2])
def test_one_or_two_wrong_stamps_do_not_touch_the_rest(at: int, off: float, run: int) -> None:
    right = clock()
    times = right.copy()
    times[at : at + run] += off
    result, told = steadied(times)
    assert 1 <= told.total() <= run + 1
    wrong = range(at, at + run)
    rest = np.delete(result, wrong)
    assert rest == pytest.approx(np.delete(right, wrong), abs=0.1)
    assert (rest == np.delete(right, wrong)).mean() > 0.99
    assert result[wrong] == pytest.approx(right[wrong], abs=0.5)


def test_two_leaping_moments_of_two_messages_each() -> None:
    times = np.repeat([1.0, 2, 9000, 9001, 3, 4], 2)
    joined = np.arange(12) % 2 == 1
    told: list[tuple[int, str]] = []
    result = monotonic(times, joined, lambda at, kind: told.append((at, kind)))
    expected = np.repeat([1, 2, 2 + TICK, 2 + 2 * TICK, 3, 4], 2)
    assert result == pytest.approx(expected, abs=1e-9)
    assert told == [(4, AHEAD), (6, AHEAD)]


def test_small_steps_back_and_standing_still_as_in_real_recordings() -> None:
    right = clock(5000)
    times = right.copy()
    rng = np.random.default_rng(1)
    at = np.sort(rng.choice(np.arange(1, 5000), 600, replace=False))
    times[at] -= rng.uniform(0, 0.9, 600)
    still = rng.choice(np.arange(1, 5000), 300, replace=False)
    times[still] = times[still - 1]
    result, told = steadied(times)
    assert set(told) == {FORWARD, STILL}
    usable = times > np.maximum.accumulate(np.r_[-np.inf, times[:-1]]) + 1e-3
    assert (result[usable] == times[usable]).all()


stamps = st.floats(-1e11, 1e11) | st.floats(0, 100) | st.sampled_from([0.0, 1.0, 50.0, 3600.0])


@given(st.lists(st.tuples(stamps, st.booleans()), min_size=1, max_size=20))
def test_any_times_increase_and_joined_ones_stay_together(found: list[tuple[float, bool]]) -> None:
    joined = np.array([False, *(together for _, together in found[1:])])
    result = monotonic(np.array([time for time, _ in found]), joined, lambda *_: None)
    assert ((np.diff(result) == 0) == joined[1:]).all()
    assert (np.diff(result) >= 0).all()


@given(st.lists(stamps, min_size=1, max_size=20, unique=True))
def test_increasing_times_are_left_alone(times: list[float]) -> None:
    increasing = np.sort(np.array(times))
    result, told = steadied(increasing)
    assert (result == increasing).all()
    assert not told
