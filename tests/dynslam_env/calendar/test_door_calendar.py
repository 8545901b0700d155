"""Doors that obey a calendar: their shares, dwell times, and that a date has one state."""

import math
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

import dynslam_env
from dynslam_env import Doors, Empirical, Habits, InPairs, Recorded, Weibull
from dynslam_env.calendar.door_calendar import MONDAY_2026, WEEK
from slam.errors import InputError
from slam.forecast.watched import Runs
from slam.io.door_runs import read_door_runs, write_door_runs

HALF_WEEK = ((0.1,) * 12 + (0.7,) * 12,) * 7  # P(open) in the morning and from noon on
REGULAR = Habits(week=HALF_WEEK, cycle=1200.0, dwell=Weibull(2.0), variety=0.0, seed=4)


def states_at(runs: Runs, times: np.ndarray) -> np.ndarray:
    return runs.state[np.searchsorted(runs.begin, times, side="right") - 1]


def dwells(runs: Runs, state: int) -> np.ndarray:
    return (runs.end - runs.begin)[1:-1][runs.state[1:-1] == state]


@pytest.fixture
def history(tmp_path: Path) -> Path:
    """Two weeks and some days of a door, with a gap; it opens for an hour each day of the first
    week only."""
    days = MONDAY_2026 - 3 * 86400.0 + np.arange(19) * 86400.0
    edges = np.stack([days, days + 9 * 3600.0, days + 10 * 3600.0, days + 86400.0], axis=1)
    begin, end = np.ravel(edges[:, :3]).astype(float), np.ravel(edges[:, 1:]).astype(float)
    state = np.tile([0, 1, 0], 19)
    state[begin >= MONDAY_2026 + WEEK] = 0
    kept = np.arange(len(begin)) != 5
    write_door_runs(Runs(begin[kept], end[kept], state[kept]), tmp_path / "door.csv")
    return tmp_path / "door.csv"


def test_a_door_is_open_for_the_share_of_each_hour():
    runs = REGULAR.runs(0, MONDAY_2026, MONDAY_2026 + 8 * WEEK)
    times = np.arange(MONDAY_2026, MONDAY_2026 + 8 * WEEK, 60.0)
    hour = ((times - MONDAY_2026) // 3600.0).astype(int) % 24
    share = np.bincount(hour, states_at(runs, times)) / np.bincount(hour)
    assert np.abs(share[3:12] - 0.1).max() < 0.05  # by then the evening is over
    assert np.abs(share[15:24] - 0.7).max() < 0.05


def test_dwell_times_have_the_shape_of_their_distribution():
    constant = ((0.5,) * 24,) * 7
    for shape in (0.6, 1.0, 3.0):
        law = Habits(week=constant, cycle=600.0, dwell=Weibull(shape), variety=0.0)
        times = dwells(law.runs(0, MONDAY_2026, MONDAY_2026 + 6 * WEEK), 1)
        assert times.mean() == pytest.approx(300.0, rel=0.06)
        variance = math.gamma(1 + 2 / shape) / math.gamma(1 + 1 / shape) ** 2 - 1
        assert times.std() / times.mean() == pytest.approx(math.sqrt(variance), rel=0.08)


def test_empirical_dwell_times_are_those_observed(history: Path):
    found = Empirical.of_file(history)
    assert found.opened == (3600.0,) * 9  # of ten days; one of them ends at the gap
    assert set(found.closed) == {23 * 3600.0}
    law = Empirical(closed=(100.0, 300.0), opened=(50.0,))
    drawn = law.draw(0, 1000, np.random.default_rng(0))
    assert set(drawn) == {0.5, 1.5}
    assert set(law.draw(1, 10, np.random.default_rng(0))) == {1.0}


def test_a_date_has_one_state_whenever_one_asks():
    whole = REGULAR.runs(2, MONDAY_2026, MONDAY_2026 + 3 * WEEK)
    times = MONDAY_2026 + np.random.default_rng(1).uniform(0, 3 * WEEK, 50)
    each = [REGULAR.runs(2, time, time + 600.0).state[0] for time in times.tolist()]
    assert np.array_equal(states_at(whole, times), each)
    assert (whole.begin[1:] == whole.end[:-1]).all()
    assert (whole.state[1:] != whole.state[:-1]).all()


def test_doors_and_seeds_differ():
    span = MONDAY_2026, MONDAY_2026 + WEEK
    ours = Habits(seed=1)
    assert not np.array_equal(ours.runs(0, *span).begin, ours.runs(1, *span).begin)
    assert not np.array_equal(ours.runs(0, *span).begin, Habits(seed=2).runs(0, *span).begin)
    assert np.ptp([ours.rates(door).mean() for door in range(20)]) > 0.1


def test_a_recorded_door_is_repeated_week_by_week(history: Path):
    recorded = Recorded(str(history))
    real = read_door_runs(history)
    times = MONDAY_2026 + np.arange(0.0, 2 * WEEK, 1800.0)
    found = recorded.runs(0, MONDAY_2026, MONDAY_2026 + 2 * WEEK)
    assert np.array_equal(states_at(found, times), states_at(real, times))
    assert states_at(found, times).sum() == 14  # an hour on each of seven days
    later = recorded.runs(1, MONDAY_2026, MONDAY_2026 + 2 * WEEK)  # a week ahead
    assert np.array_equal(states_at(later, times), np.roll(states_at(found, times), -7 * 48))
    years = 104 * WEEK
    again = recorded.runs(0, MONDAY_2026 + years, MONDAY_2026 + years + 2 * WEEK)
    assert np.array_equal(again.begin - years, found.begin)


def test_a_history_without_a_whole_week_is_refused(tmp_path: Path):
    day = np.array([MONDAY_2026, MONDAY_2026 + 3600.0])
    write_door_runs(Runs(day, day + 3600.0, np.array([0, 1])), tmp_path / "short.csv")
    with pytest.raises(InputError, match="whole week"):
        Recorded(str(tmp_path / "short.csv"))


def test_pairs_move_together_or_opposed():
    span = MONDAY_2026, MONDAY_2026 + WEEK
    same, other = InPairs(REGULAR), InPairs(REGULAR, opposed=True)
    assert np.array_equal(same.runs(0, *span).state, same.runs(1, *span).state)
    assert np.array_equal(other.runs(2, *span).state, 1 - other.runs(3, *span).state)
    assert np.array_equal(same.runs(1, *span).begin, REGULAR.runs(0, *span).begin)


def test_an_environment_begins_at_the_date():
    law = Habits(cycle=60.0, begin=MONDAY_2026 + 9 * 3600.0, seed=5)
    env = gym.make("DoorCorridor-v0", doors=Doors(law=law, swing_time=0.5))
    world = env.unwrapped
    assert isinstance(world, dynslam_env.DoorWorldEnv)
    _, info = env.reset(seed=1)
    histories = [law.runs(door, law.begin, law.begin + 100.0) for door in range(8)]
    assert np.array_equal(info["door_angles"] > 0.5, [h.state[0] == 1 for h in histories])
    for _ in range(600):
        info = env.step(np.zeros(2, np.float32))[-1]
    settled = [len(h.begin[(h.begin > law.begin + 56) & (h.begin < law.begin + 62)]) == 0
               for h in histories]  # fmt: skip
    states = np.array([states_at(h, np.array([law.begin + 60.0]))[0] == 1 for h in histories])
    assert sum(settled) >= 4
    assert np.array_equal((info["door_angles"] > 0.5)[settled], states[settled])


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Habits(week=((0.5,) * 24,) * 6), "7 days"),
        (lambda: Habits(week=((1.5,) * 24,) * 7), "from 0 to 1"),
        (lambda: Habits(cycle=0.0), "cycle"),
        (lambda: Weibull(0.0), "shape"),
        (lambda: Empirical((), (1.0,)), "Empirical.closed"),
        (lambda: Recorded("missing.csv"), "missing.csv"),
        (lambda: InPairs("doors"), "InPairs.calendar"),  # pyright: ignore[reportArgumentType]
    ],
)
def test_wrong_parameters_are_refused(make, message: str):
    with pytest.raises(InputError, match=message):
        make()
