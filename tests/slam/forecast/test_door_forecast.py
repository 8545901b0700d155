"""What a forecast must be for any door, and what it must learn of doors whose law is known."""

import sys
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slam import DoorForecast, InputError
from slam.forecast.relaxation import LAG_END
from slam.forecast.watched import Runs
from tests.slam.forecast.habits import (
    DAY,
    HOUR,
    MINUTE,
    MONDAY,
    WEEK,
    chain,
    office,
    runs_of,
    short_or_long,
)  # fmt: skip

lengths = st.integers(1, 3000)
histories = st.lists(st.tuples(lengths, st.sampled_from([-1, 0, 1])), min_size=1, max_size=30)


def history(pieces: list[tuple[int, int]]) -> Runs:
    return runs_of(np.repeat([state for _, state in pieces], [n for n, _ in pieces]).astype(int))


@pytest.fixture(scope="module")
def worker() -> DoorForecast:
    return DoorForecast.fit(*runs_of(office(8)))


@pytest.fixture(scope="module")
def restless() -> DoorForecast:
    return DoorForecast.fit(*runs_of(chain(40 * 1440, 0.01, 0.03, seed=1)))


@settings(max_examples=40)
@given(histories, st.integers(-5000, 50_000), st.integers(0, 5000), st.sampled_from([0, 1]))
def test_a_forecast_is_a_probability(pieces, after, lag, seen) -> None:
    door = DoorForecast.fit(*history(pieces))
    looked = MONDAY + MINUTE * after
    times = looked + np.array([0.0, 30.0, 60.0 * lag, WEEK, -DAY])
    for found in (
        door.probability(times),
        door.probability(times, looked, seen),
        door.probability(times, looked, seen, looked - 60.0 * lag),
        door.ahead(times),
    ):
        assert found.shape == (5,)
        assert ((found > 0.0) & (found < 1.0)).all()


@settings(max_examples=40)
@given(histories, st.integers(0, 10_000), st.sampled_from([0, 1]))
def test_what_is_just_seen_is_so_and_is_forgotten_in_the_end(pieces, minute, seen) -> None:
    door = DoorForecast.fit(*history(pieces))
    looked = MONDAY + MINUTE * minute
    assert door.probability(looked, looked, seen) == pytest.approx(seen, abs=1e-3)
    later = looked + np.array([2.0 * DAY, WEEK])
    assert door.probability(later, looked, seen) == pytest.approx(door.probability(later))


@settings(max_examples=40)
@given(histories, st.integers(0, 10_000), st.floats(0.0, 2 * DAY))
def test_a_look_never_speaks_for_the_other_state(pieces, minute, lag) -> None:
    door = DoorForecast.fit(*history(pieces))
    looked = MONDAY + MINUTE * minute
    shut, unknown, opened = (
        door.probability(looked + lag, *look) for look in ((looked, 0), (), (looked, 1))
    )
    assert shut <= unknown <= opened


@settings(max_examples=20)
@given(histories, st.integers(1, 29))
def test_it_makes_no_difference_in_which_parts_a_history_is_handed_in(pieces, cut) -> None:
    runs = history(pieces)
    whole, parts = DoorForecast.fit(*runs), DoorForecast()
    parts.update(*(part[:cut] for part in runs))
    parts.update(*(part[cut:] for part in runs))
    for name, sums in whole.sums().items():
        np.testing.assert_allclose(parts.sums()[name], sums, rtol=1e-9, atol=1e-9)
    assert parts.look == whole.look


def test_nothing_known_is_one_half_and_a_look_counts_for_an_hour() -> None:
    door = DoorForecast()
    assert door.probability(MONDAY) == pytest.approx(0.5)
    assert door.ahead(MONDAY) == pytest.approx(0.5)
    assert door.probability(MONDAY + HOUR, MONDAY, 1) == pytest.approx(0.5 + 0.5 / np.e, abs=0.01)


def test_arguments_are_broadcast(worker: DoorForecast) -> None:
    times, looks = MONDAY + HOUR * np.arange(6.0)[:, None], MONDAY - MINUTE * np.arange(1.0, 4.0)
    found = worker.probability(times, looks, np.array([0, 1, 1]))
    assert found.shape == (6, 3)
    assert found[4, 1] == worker.probability(times[4, 0], looks[1], 1)
    assert np.ndim(worker.probability(MONDAY)) == 0
    assert worker.probability(np.zeros((0, 2))).shape == (0, 2)


def test_hours_and_weekdays_are_learned(worker: DoorForecast) -> None:
    later = MONDAY + 9 * WEEK
    noon = later + DAY * np.arange(7.0) + 13 * HOUR
    assert (worker.probability(noon)[:5] > 0.9).all()
    assert (worker.probability(noon)[5:] < 0.1).all()
    assert (worker.probability(noon + 9 * HOUR) < 0.05).all()


def test_the_week_is_a_table_of_rates_and_hours(worker: DoorForecast) -> None:
    week = worker.to_dict()
    rate, watched = np.array(week["rate"]), np.array(week["watched_hours"])
    assert rate.shape == watched.shape == (7, 24)
    assert watched == pytest.approx(8.0)
    assert (rate[:5, 10:16] > 0.9).all()
    assert week["timezone"] == "UTC"


@pytest.mark.parametrize("lag", [1, 5, 20, 60, 200])
def test_the_relaxation_of_a_markov_chain_is_learned(restless: DoorForecast, lag: int) -> None:
    """Its correlation is known: (1 - rise - fall) to the power of the lag."""
    looked = MONDAY + 41 * DAY
    found = restless.probability(looked + MINUTE * lag, looked, np.array([0, 1]))
    assert np.diff(found)[0] == pytest.approx(0.96**lag, abs=0.08)
    assert restless.probability(looked) == pytest.approx(0.25, abs=0.06)


def test_long_dwells_last_longer_if_it_is_known_since_when() -> None:
    door = DoorForecast.fit(*runs_of(short_or_long(1500, seed=2)))
    seen = door.look.time if door.look else 0.0
    ahead = seen + 10 * MINUTE
    new, unknown, old = (
        door.probability(ahead, seen, 1, since) for since in (seen, None, seen - 40 * MINUTE)
    )
    assert new < unknown - 0.1
    assert old > unknown
    assert door.lasting(1, 0.0, 600.0) == pytest.approx(0.5, abs=0.05)
    assert door.lasting(1, 2400.0, 600.0) > 0.97
    assert door.lasting(1, 2400.0, [0.0, DAY])[1] < 0.01


def test_the_last_look_and_since_when_are_remembered() -> None:
    door = DoorForecast()
    door.update(MONDAY, MONDAY + HOUR, 0)
    assert door.look == (MONDAY + HOUR, 0, None)
    door.update(MONDAY + HOUR, MONDAY + 2 * HOUR, 1)
    door.observe(MONDAY + 2 * HOUR + 30.0, 1)
    assert door.look is not None
    assert door.look == (MONDAY + 2 * HOUR + 30.0, 1, MONDAY + HOUR)
    later = MONDAY + 2.1 * HOUR
    assert door.ahead(later) == door.probability(later, door.look.time, 1, MONDAY + HOUR)
    door.observe(MONDAY + 3 * HOUR, 1)
    assert door.look == (MONDAY + 3 * HOUR, 1, None)


def test_a_few_looks_a_day_teach_the_hours() -> None:
    """A robot that comes by nine times a day, for three weeks."""
    door, states = DoorForecast(), office(3)
    for minute in range(7, len(states), 161):
        door.observe(MONDAY + MINUTE * minute, int(states[minute]))
    later = MONDAY + 3 * WEEK + DAY * np.arange(5.0)
    assert (door.probability(later + 13 * HOUR) > 0.6).all()
    assert (door.probability(later + 2 * HOUR) < 0.2).all()
    assert door.probability(later[0] + 6 * DAY + 13 * HOUR) < 0.3


def test_new_habits_replace_old_ones() -> None:
    states = office(60)
    states[30 * 7 * 1440 :] = 1 - states[30 * 7 * 1440 :]
    door = DoorForecast.fit(*runs_of(states), half_life_days=20.0)
    assert door.probability(MONDAY + 60 * WEEK + 13 * HOUR) < 0.1


def test_the_weights_stay_finite_over_many_half_lives() -> None:
    door = DoorForecast.fit(*runs_of(office(30)[: -2 * 1440]), half_life_days=2.0)
    assert max(float(abs(sums).max()) for sums in door.sums().values()) < 1e16
    assert door.probability(MONDAY + 30 * WEEK + 13 * HOUR) > 0.5


def test_memory_is_constant() -> None:
    def size(door: DoorForecast) -> int:
        arrays = [*door.sums().values(), door.window.state, door.window.age, door.known_rates,
                  door.watched_hours]  # fmt: skip
        return sum(array.nbytes for array in arrays) + sum(map(sys.getsizeof, vars(door).values()))

    short, long = (DoorForecast.fit(*runs_of(office(weeks))) for weeks in (1, 40))
    assert size(short) == size(long) < 100_000
    assert long.window.state.shape == (LAG_END,)
    assert all(array.base is None or array.base.nbytes < 100_000 for array in (
        long.window.state, long.window.age))  # fmt: skip


def test_daylight_saving_time_is_of_the_building() -> None:
    """Nine to five in London, half a year on: an hour early in UTC."""
    london = DoorForecast.fit(*runs_of(office(8)), timezone="Europe/London")
    utc = DoorForecast.fit(*runs_of(office(8)))
    july = MONDAY + 27 * WEEK  # a Monday
    assert london.probability(july + 8.4 * HOUR) == utc.probability(july + 9.4 * HOUR)
    assert london.probability(july + 8.4 * HOUR) > utc.probability(july + 8.4 * HOUR) + 0.2


def test_gaps_are_no_states() -> None:
    states = office(8)
    states[10_000:40_000] = -1
    door = DoorForecast.fit(*runs_of(states))
    assert np.array(door.to_dict()["watched_hours"]).sum() == pytest.approx(8 * 168 - 500)
    assert door.probability(MONDAY + 9 * WEEK + 13 * HOUR) > 0.9


WRONG: dict[str, tuple[Callable[[], object], str]] = {
    "NaN": (lambda: DoorForecast.fit([0.0, np.nan], [60.0, 120.0], [0, 1]), "finite unix times"),
    "lengths": (lambda: DoorForecast.fit([0.0], [60.0, 120.0], [0, 1]), "of one length"),
    "ragged": (lambda: DoorForecast.fit([0.0, [1.0]], [60.0, 1.0], [0, 1]), "numbers"),
    "text": (lambda: DoorForecast.fit(["a"], [60.0], [0]), "unix times in s"),
    "milliseconds": (lambda: DoorForecast.fit([1.4e12], [1.5e12], [0]), "finite unix times"),
    "state": (lambda: DoorForecast.fit([0.0], [60.0], [2]), "state must be 0 or 1, got 2"),
    "state NaN": (lambda: DoorForecast.fit([0.0], [60.0], [np.nan]), "state must be 0 or 1"),
    "empty run": (lambda: DoorForecast.fit([60.0], [60.0], [1]), "run 0 ends at 60 s, not after"),
    "back": (lambda: DoorForecast.fit([0, 60.0], [90.0, 99.0], [1, 0]), "was the clock set back"),
    "half life": (lambda: DoorForecast(half_life_days=0), "half_life_days must be"),
    "zone": (lambda: DoorForecast("Mars/Olympus"), "timezone must be a name"),
    "t": (lambda: DoorForecast().probability(np.nan), "t must be finite"),
    "half a look": (lambda: DoorForecast().probability(0.0, seen=1), "give seen_at and seen"),
    "seen": (lambda: DoorForecast().probability(0.0, 0.0, 0.5), "seen must be 0 or 1, got 0.5"),
    "since": (lambda: DoorForecast().probability(9.0, 0.0, 1, 5.0), "not be later than seen_at"),
    "shapes": (lambda: DoorForecast().probability([0.0] * 2, [0.0] * 3, 1), "do not broadcast"),
    "lasting": (lambda: DoorForecast().lasting(1, -1.0, 5.0), "at least 0 s"),
    "further": (lambda: DoorForecast().lasting(1, 0.0, [-5.0]), "at least 0 s"),
    "decades": (lambda: DoorForecast.fit([0.0], [9e8], [1]), "over ten years"),
    "look NaN": (lambda: DoorForecast().observe(np.nan, 1), "t must be finite"),
    "many looks": (lambda: DoorForecast().observe(np.zeros(2), 1), "t must be a single number"),
    "looks": (lambda: DoorForecast().observe(0.0, 2), "state must be 0 or 1, got 2"),
    "far": (lambda: DoorForecast().lasting(1, 0.0, 1e9), "at most a week"),
}  # fmt: skip


def test_what_two_forecasts_learned_is_added() -> None:
    begin, restless = MONDAY + 3 * WEEK, chain(2 * 7 * 1440, 0.01, 0.03, seed=2)
    times = MONDAY + 5 * WEEK + np.arange(0.0, WEEK, 600.0)
    later = DoorForecast.fit(*runs_of(restless, begin))
    for states in (office(3), chain(3 * 7 * 1440, 0.01, 0.03, seed=1)):
        first, both = (DoorForecast.fit(*runs_of(states)) for _ in range(2))
        both.update(*runs_of(restless, begin))
        made = first.joined(later)
        assert made.reference is not None
        assert both.reference is not None
        for name in ("week_watched", "week_open"):
            weights = np.exp2((made.reference - both.reference) / made.half_life_days)
            sums, expected = weights * made.sums()[name], both.sums()[name]
            np.testing.assert_allclose(sums[:, 1:], expected[:, 1:])  # a first look counts 30 min
        np.testing.assert_array_equal(made.watched_hours, both.watched_hours)
        assert made.look == later.look
        np.testing.assert_allclose(made.probability(times), both.probability(times), atol=0.05)
        again = later.joined(first)
        np.testing.assert_array_equal(again.probability(times), made.probability(times))
    looked = times[0] + 60.0 * np.array([1, 15, 60]), times[0], 1  # of a door with one law
    np.testing.assert_allclose(made.probability(*looked), both.probability(*looked), atol=0.03)


def test_only_forecasts_alike_are_joined(worker: DoorForecast) -> None:
    nothing = DoorForecast()
    assert nothing.joined(worker).probability(MONDAY) == worker.probability(MONDAY)
    assert worker.joined(nothing).probability(MONDAY) == worker.probability(MONDAY)
    with pytest.raises(InputError, match="one timezone and one half-life"):
        worker.joined(DoorForecast(half_life_days=9.0))


@pytest.mark.parametrize("name", WRONG)
def test_bad_input_is_told(name: str) -> None:
    call, message = WRONG[name]
    with pytest.raises(InputError, match=message):
        call()


def test_a_clock_set_back_between_updates_is_told_and_changes_nothing() -> None:
    door = DoorForecast.fit([MONDAY], [MONDAY + DAY], [1])
    before = door.probability(MONDAY + DAY)
    with pytest.raises(InputError, match="was the clock set back"):
        door.update(MONDAY + HOUR, MONDAY + 2 * DAY, 0)
    with pytest.raises(InputError, match="was the clock set back"):
        door.observe(MONDAY + HOUR, 0)
    assert door.probability(MONDAY + DAY) == before
    assert door.look == (MONDAY + DAY, 1, None)
