"""The work of `dynslam forecast`: Brier scores by the time since the look, and calibration."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from slam.errors import InputError
from slam.forecast.door import DoorForecast
from slam.forecast.watched import Runs
from slam.geometry import Array
from slam.io.door_runs import read_door_runs
from slam.io.forecast_file import save_forecast
from slam.metrics.lost import Reliability, calibration_error, pooled, reliability

from ..console.output import own_directory, write_json, write_png
from ..figures.week_figure import Calibration, week_figure
from .door_baselines import SEEING, UNSEEING, Forecast
from .door_minutes import MINUTE, WEEK, Looks, Minutes, between, looks, minutes_of
from .drives import write_table

if TYPE_CHECKING:
    from .forecast import ForecastCommand

HORIZONS = (0, 1, 5, 15, 60, 240, 1440)  # min since the look; 0: nothing was seen
HEADINGS = ("nothing seen", "1 min", "5 min", "15 min", "60 min", "4 h", "1 day")
DRAWN = (0, 1, 15, 60)  # of these the reliability is drawn
FIRST_WEEK = 5  # the first that is forecast without files of later weeks
OURS, OURS_SINCE = "DoorForecast", "DoorForecast, and since when"
WEEK_S = float(WEEK * MINUTE)


class Score(NamedTuple):
    """Of one forecast at one horizon, in one week."""

    brier: float
    reliability: Reliability


Scores = dict[str, dict[int, list[Score]]]
"""By name of the forecast, and by horizon: one score a week."""


def run_forecast(options: ForecastCommand) -> int:
    """Learn, score, write, print; the exit status."""
    history = read_door_runs(options.history)
    splits = _splits(history, [read_door_runs(path) for path in options.weeks])
    door = DoorForecast.fit(*history, timezone=options.timezone)
    out = own_directory(options.out)
    scores: Scores = {}
    for known, week in splits:
        _add(scores, known, minutes_of(week), options.timezone)
    write_table(table(scores), out)
    write_json(as_dict(scores), out / "scores.json")
    save_forecast(door, out / "door.npz")
    figure = week_figure(door.to_dict(), _calibrations(scores), options.history.stem)
    write_png(figure, out / "week.png")
    print(f"look at {out / 'week.png'}")
    return 0


def _splits(history: Runs, weeks: list[Runs]) -> Iterator[tuple[Runs, Runs]]:
    """What is learned from, and what is forecast."""
    if weeks:
        return ((history, week) for week in weeks)
    begins = np.arange(history.begin[0] + FIRST_WEEK * WEEK_S, history.end[-1] - 1, WEEK_S)
    if not len(begins):
        raise InputError(f"the history has no week after the first {FIRST_WEEK}: name later weeks")
    return (
        (between(history, -np.inf, begin), between(history, begin, begin + WEEK_S))
        for begin in begins.tolist()
    )


def forecasts(known: Runs, timezone: str) -> dict[str, Forecast]:
    """All forecasts, learned from `known`."""
    minutes = minutes_of(known)
    if len(np.unique(minutes.state)) < 2:
        raise InputError("the history must have both states, for at least a minute each")
    door = DoorForecast.fit(*known, timezone=timezone)
    plain = {name: learn(minutes) for name, learn in {**UNSEEING, **SEEING}.items()}
    return {**plain, OURS: _ours(door), OURS_SINCE: _ours_since(door)}


def _ours(door: DoorForecast) -> Forecast:
    def forecast(minutes: Minutes, pairs: Looks, horizon: int) -> Array:
        times = MINUTE * minutes.minute
        if not horizon:
            return door.probability(times[pairs.now])
        return door.probability(times[pairs.now], times[pairs.look], minutes.state[pairs.look])

    return forecast


def _ours_since(door: DoorForecast) -> Forecast:
    def forecast(minutes: Minutes, pairs: Looks, horizon: int) -> Array:
        times, since = MINUTE * minutes.minute, minutes.since[pairs.look]
        found, known = _ours(door)(minutes, pairs, horizon), np.isfinite(since)
        found[known] = door.probability(
            times[pairs.now[known]], times[pairs.look[known]],
            minutes.state[pairs.look[known]], since[known],
        )  # fmt: skip
        return found

    return forecast


def _add(scores: Scores, known: Runs, minutes: Minutes, timezone: str) -> None:
    """Append the scores of one week."""
    for name, forecast in forecasts(known, timezone).items():
        for horizon in HORIZONS:
            if horizon or name not in (*SEEING, OURS_SINCE):
                pairs = looks(minutes, horizon)
                score = _score(forecast(minutes, pairs, horizon), minutes.state[pairs.now])
                scores.setdefault(name, {}).setdefault(horizon, []).append(score)


def _score(probability: Array, state: np.ndarray) -> Score:
    if not len(state):
        raise InputError(f"a week that is forecast is watched for more than {max(HORIZONS)} min")
    brier = float(np.mean((probability - state) ** 2))
    return Score(brier, reliability(probability, state > 0))


def mean_brier(scores: list[Score]) -> float:
    """Mean over the weeks."""
    return float(np.mean([score.brier for score in scores]))


def pooled_error(scores: list[Score]) -> float:
    """Expected calibration error of all minutes of all weeks."""
    return calibration_error(pooled([score.reliability for score in scores]))


def table(scores: Scores) -> str:
    """Markdown: Brier scores, and the expected calibration errors of ours."""
    lines = [("mean Brier score", *HEADINGS), ("---",) * (1 + len(HEADINGS))]
    for name, by_horizon in scores.items():
        cells = (by_horizon.get(horizon) for horizon in HORIZONS)
        lines.append(
            (name, *("-" if cell is None else f"{mean_brier(cell):.4f}" for cell in cells))
        )
    for name in (OURS, OURS_SINCE):
        cells = (scores[name].get(horizon) for horizon in HORIZONS)
        errors = ("-" if cell is None else f"{pooled_error(cell):.4f}" for cell in cells)
        lines.append((f"calibration error of {name}", *errors))
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def as_dict(scores: Scores) -> Mapping[str, object]:
    """For JSON: each week's Brier score, and the pooled reliability diagram."""
    return {
        name: {
            str(horizon): {
                "brier": [score.brier for score in cell],
                "calibration_error": pooled_error(cell),
                "reliability": pooled([score.reliability for score in cell])._asdict(),
            }
            for horizon, cell in by_horizon.items()
        }
        for name, by_horizon in scores.items()
    }


def _calibrations(scores: Scores) -> list[Calibration]:
    """What is drawn of ours."""
    drawn = ((horizon, scores[OURS][horizon]) for horizon in DRAWN)
    return [
        Calibration(HEADINGS[HORIZONS.index(horizon)], pooled([one.reliability for one in cell]))
        for horizon, cell in drawn
    ]
