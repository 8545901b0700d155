"""Forecast of a door: its week, how long its states last, and what a look at it is worth."""

from __future__ import annotations

import copy
from typing import Any, NamedTuple

import numpy as np

from slam.errors import InputError
from slam.forecast import dwell, relaxation, watched
from slam.forecast.clock import DAY_MINUTES, MINUTE, WEEK_MINUTES, WeekClock
from slam.forecast.relaxation import LAG_END, LAGS, LagSums, Pairs
from slam.forecast.week import BIN, WeekCounts, at_minutes
from slam.geometry import Array
from slam.validation import positive_number

HALF_LIFE = 50.0  # days, after which what was seen counts half
HOURS = (7, 24)
RESCALED_AFTER = 30  # half-lives from the reference day of the weights, before they grow too large


class Look(NamedTuple):
    """The last look at a door.

    time   s, unix time
    state  0 or 1
    since  s, from which on the state was watched without a change; None: its begin was not seen
    """

    time: float
    state: int
    since: float | None


class DoorForecast:
    """P(state = 1) of one door at any time, learned online in constant memory.

    The rates are those of the time of the week. One look moves the forecast away from them, by an
    amount that is learned for time lags up to two days: `relaxation`. `docs/forecast.md` has the
    equations and the scores on a real door.

    timezone        of the building, an IANA name; "UTC" will do where the clock is never changed
    half_life_days  after which what was seen counts half
    """

    def __init__(self, timezone: str = "UTC", half_life_days: float = HALF_LIFE) -> None:
        positive_number("half_life_days", half_life_days)
        self.clock, self.half_life_days = WeekClock(timezone), float(half_life_days)
        self.week, self.lags, self.dwells = WeekCounts(), LagSums(), dwell.DwellCounts()
        self.window = watched.Window()
        self.watched_hours = np.zeros(HOURS)  # by weekday and hour, none of them forgotten
        self.look: Look | None = None
        self.reference: int | None = None  # day since 1970 whose minutes are counted with weight 1
        self.rates_day: int | None = None  # for which the rates were worked out
        self.estimates = self.week.estimates(1.0)  # at the begin of that day
        self.known_rates = self.week.blend(self.estimates, 1.0)
        self._curves: tuple[Array, Array] | None = None  # worked out when they are asked for
        self._rates: Array | None = None

    @classmethod
    def fit(
        cls, begin_s: Any, end_s: Any, state: Any, *, timezone: str = "UTC",
        half_life_days: float = HALF_LIFE,
    ) -> DoorForecast:  # fmt: skip
        """Learn from runs of equal state, in order of time.

        begin_s, end_s  (n,) s, unix time; gaps between runs are times when nobody looked
        state           (n,) 0 or 1

        The same as `update` of a new forecast. Raises InputError.
        """
        door = cls(timezone, half_life_days)
        door.update(begin_s, end_s, state)
        return door

    def update(self, begin_s: Any, end_s: Any, state: Any) -> None:
        """Learn from further runs, (n,) as for `fit` or one as three numbers; they begin after
        those before have ended. Raises InputError."""
        after = -np.inf if self.look is None else self.look.time
        runs = watched.checked(begin_s, end_s, state, after)
        for minutes, seen in watched.days(runs, self.window.last):
            self._learn(minutes, seen)
        for run in zip(*(part.tolist() for part in runs), strict=True):
            self._remember(*run)

    def observe(self, t: Any, state: Any) -> None:
        """Learn from one look at `t`, s (unix time), not before the last one. Raises InputError.

        A minute counts once, with the state of its first look. Looks in adjacent minutes count as
        watching. A look counts for the time since the one before, at most 30 min.
        """
        time = float(_one("t", watched.check_times("t", t)))
        seen = int(_one("state", watched.check_states("state", state)))
        if self.look is not None and time < self.look.time:
            raise InputError(
                f"the look at {time:.0f} s comes after one at {self.look.time:.0f} s: was the "
                f"clock set back?"
            )
        minute = int(time // MINUTE)
        if self.window.last is None or minute > self.window.last:
            self._learn(np.array([minute]), np.array([seen], np.int8))
        self._remember(time, time, seen)

    def joined(self, other: DoorForecast) -> DoorForecast:
        """What two forecasts of one door have learned, as one; neither is changed.

        Rates, dwell times and the worth of looks are weighted sums, which are added; the last look
        is the later one. A minute that both watched counts twice. Raises InputError unless time
        zone and half-life are equal.
        """
        if (self.clock.name, self.half_life_days) != (other.clock.name, other.half_life_days):
            raise InputError("forecasts are joined that have one timezone and one half-life")
        first, last = sorted(
            (self, other), key=lambda one: -np.inf if one.look is None else one.look.time
        )
        result = copy.deepcopy(last)
        if first.reference is None or result.reference is None:
            return result
        apart = (first.reference - result.reference) / self.half_life_days
        learned = first.sums()
        for name, sums in result.sums().items():
            sums += np.exp2(apart) * learned[name]
        result.watched_hours += first.watched_hours
        result._know_rates()
        result._curves = result._rates = None
        return result

    def probability(self, t: Any, seen_at: Any = None, seen: Any = None, since: Any = None) -> Any:
        """P(state = 1) at unix times `t`, s; the arguments are broadcast.

        seen_at  s, unix time of the last look; None: nothing was seen, the rate of the week is
                 returned. Times before a look are treated as those after it
        seen     0 or 1, the state seen then
        since    s, unix time from which on that state was watched without a change, if its begin
                 was seen: a state that has lasted long lasts longer

        Returns an array of the broadcast shape, or a number. Raises InputError.
        """
        times = watched.check_times("t", t)
        rate = self._rate(times)
        if seen_at is None and seen is None and since is None:
            return rate[()]
        if seen_at is None or seen is None:
            raise InputError("a look has a time and a state: give seen_at and seen, or neither")
        looked, state = watched.check_times("seen_at", seen_at), watched.check_states("seen", seen)
        age = _age(looked, since)
        try:
            parts = np.broadcast_arrays(times, rate, looked, self._rate(looked), state, age)
        except ValueError as error:
            raise InputError(f"t, seen_at, seen and since do not broadcast: {error}") from None
        times, rate, looked, rate0, state, age = (part.ravel() for part in parts)
        rho = self._rho(np.abs(times - looked) / MINUTE, state, age)
        return relaxation.forecast(rate, rate0, state, rho).reshape(parts[0].shape)[()]

    def ahead(self, t: Any) -> Any:
        """P(state = 1) at unix times `t`, s, given the last look that was learned from, and since
        when that state was watched."""
        if self.look is None:
            return self.probability(t)
        return self.probability(t, *self.look[:2], self.look.since)

    def lasting(self, state: Any, age_s: Any, further_s: Any) -> Any:
        """P(a state that began `age_s` s ago does not change for `further_s` s, up to a week).

        From the life table of both states, which knows no time of the day.
        """
        seen = int(_one("state", watched.check_states("state", state)))
        age = float(_one("age_s", watched.check_times("age_s", age_s)))
        ahead = watched.check_times("further_s", further_s)
        if age < 0 or not (ahead >= 0).all():
            raise InputError("age_s and further_s must be times of at least 0 s")
        if not (ahead <= MINUTE * dwell.MAX_AHEAD).all():
            raise InputError("further_s must be at most a week, 604800 s")
        hazards = self.dwells.hazards(self._scale())[seen]
        minutes = np.rint(ahead / MINUTE).astype(np.int64)
        left = dwell.survival(hazards, int(age // MINUTE), minutes.ravel())
        return left.reshape(minutes.shape)[()]

    def rates(self) -> Array:
        """(1008,) P(state = 1) in each ten minutes of the week, from Monday 0:00 local time."""
        if self._rates is None:
            self._rates = self.week.rates(self._scale())
        return self._rates.copy()

    def to_dict(self) -> dict[str, Any]:
        """The door's week for JSON: 7 lists (Monday first) of 24 hours of the local clock.

        rate           P(state = 1), the mean over the hour
        watched_hours  h for which the door was watched, in all
        """
        rate = self.rates().reshape(*HOURS, 60 // BIN).mean(axis=-1)
        return {
            "timezone": self.clock.name,
            "rate": np.round(rate, 4).tolist(),
            "watched_hours": np.round(self.watched_hours, 2).tolist(),
        }

    def sums(self) -> dict[str, Array]:
        """All weighted sums that were learned, by name; they can be written to."""
        return {
            "week_watched": self.week.watched,
            "week_open": self.week.open,
            "week_errors": self.week.errors,
            "lags_common": self.lags.common,
            "lags_fit": self.lags.fit,
            "dwells_watched": self.dwells.watched,
            "dwells_ended": self.dwells.ended,
        }

    # -- learning ------------------------------------------------------------------------------

    def _learn(self, minutes: np.ndarray, states: np.ndarray) -> None:
        """Learn from new minutes of one day; what a look is worth, with the rates known at the
        day's begin, so that it makes no difference how the minutes were handed in."""
        day = int(minutes[0]) // DAY_MINUTES
        if self.reference is None:
            self.reference = day
        if day != self.rates_day:
            self._rescale(day)
            self.rates_day = day
            self._know_rates()
        block = self.window.append(minutes, states)
        weights = self._weights(block)
        of_week = self._minute_of_week(block.first + block.new)
        new = block.state[block.new]
        self.week.compare(self.estimates, of_week, new, weights * block.weight)
        self.week.add(of_week, new, weights * block.weight)
        hours = np.bincount(of_week // 60, minlength=WEEK_MINUTES // 60).reshape(HOURS)
        self.watched_hours += hours * (MINUTE / 3600.0)
        self._learn_dwells(block, weights)
        self._learn_lags(block, weights)
        self._curves = self._rates = None

    def _know_rates(self) -> None:
        """Work out the rates from what was learned so far."""
        self.estimates = self.week.estimates(self._scale())
        self.known_rates = self.week.blend(self.estimates, self._scale())

    def _learn_dwells(self, block: watched.Block, weights: Array) -> None:
        """A minute of known age, and whether the state changed in the next."""
        before = block.new - 1
        known = (block.state[before] >= 0) & (block.age[before] >= 0)
        state = block.state[before[known]]
        ended = block.state[block.new[known]] != state
        self.dwells.add(state, block.age[before[known]], ended, weights[known])

    def _learn_lags(self, block: watched.Block, weights: Array) -> None:
        """Each new minute is paired with the latest look in each bin of time lags."""
        index = np.where(block.state >= 0, np.arange(len(block.state)), -1)
        latest = np.maximum.accumulate(index)
        at = latest[np.maximum(block.new - LAGS[:, None], 0)]
        ends = np.append(LAGS[1:], LAG_END)[:, None]
        lag, place = np.nonzero((at >= 0) & (block.new - at < ends) & (block.new >= LAGS[:, None]))
        looked, later = at[lag, place], block.new[place]
        of_week = self._minute_of_week(block.first + np.arange(len(block.state)))
        week = at_minutes(self.known_rates, of_week)
        pairs = Pairs(
            lag, block.state[looked], block.state[later], week[looked], week[later],
            relaxation.age_bin(block.age[looked]),
        )  # fmt: skip
        self.lags.add(pairs, weights[place])

    def _remember(self, begin: float, end: float, state: int) -> None:
        """Keep the last look; `since` only where the change before it was watched."""
        since, last = None, self.look
        if last is not None and begin - last.time <= MINUTE:
            since = begin if state != last.state else last.since
        self.look = Look(end, state, since)

    # -- forgetting ----------------------------------------------------------------------------

    def _weights(self, block: watched.Block) -> Array:
        """(n,) weights of the new minutes: they grow with time, which is to forget those before."""
        assert self.reference is not None
        days = (block.first + block.new) / DAY_MINUTES - self.reference
        return np.exp2(days / self.half_life_days)

    def _scale(self) -> float:
        """What makes the weight of the minute watched last 1."""
        if self.reference is None or self.window.last is None:
            return 1.0
        days = self.window.last / DAY_MINUTES - self.reference
        return float(np.exp2(-days / self.half_life_days))

    def _rescale(self, day: int) -> None:
        """Count from `day` on with weight 1, if weights have grown large."""
        assert self.reference is not None
        passed = (day - self.reference) / self.half_life_days
        if passed <= RESCALED_AFTER:
            return
        for sums in self.sums().values():
            sums *= np.exp2(-passed)
        self.reference = day

    # -- forecasting ---------------------------------------------------------------------------

    def _rate(self, times: Array) -> Array:
        return at_minutes(self.rates(), self.clock.minute_of_week(times))

    def _minute_of_week(self, minutes: np.ndarray) -> np.ndarray:
        return self.clock.minute_of_week(MINUTE * minutes.astype(np.float64))

    def _rho(self, lag: Array, state: np.ndarray, age: np.ndarray) -> Array:
        """(n,) worth of looks `lag` min away; age in min, -1: not known."""
        if self._curves is None:
            self._curves = self.lags.curves(self._scale())
        common, by_age = self._curves
        rho = relaxation.interpolated(common[:, None], lag)
        known = age >= 0
        own = by_age[:, state[known].astype(np.int64), relaxation.age_bin(age[known])]
        rho[known] = relaxation.interpolated(own, lag[known]) if known.any() else 0.0
        return rho


def _one(name: str, value: np.ndarray) -> np.ndarray:
    """A single value. Raises InputError for an array."""
    if value.ndim:
        raise InputError(f"{name} must be a single number, got an array of shape {value.shape}")
    return value


def _age(looked: Array, since: Any) -> np.ndarray:
    """Age of the state in min at a look; -1 without `since`."""
    if since is None:
        return np.array(watched.UNKNOWN)
    begun = watched.check_times("since", since)
    try:
        age = (looked - begun) // MINUTE
    except ValueError as error:
        raise InputError(f"seen_at and since do not broadcast: {error}") from None
    if (age < 0).any():
        raise InputError("since, the begin of the state, must not be later than seen_at")
    return age.astype(np.int64)
