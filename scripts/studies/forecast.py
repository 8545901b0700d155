"""`dynslam forecast`: how well a door is forecast, beside plain baselines."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import tyro


@dataclass
class ForecastCommand:
    """Learn a door's habits from its history and score forecasts of later weeks.

    A history is a CSV file `begin_s,end_s,state` (unix times; state 0 or 1). Writes table.md,
    scores.json, the forecast door.npz and week.png, a heat map of hours by weekdays.
    """

    history: tyro.conf.Positional[Path]
    """The history that is learned from."""
    weeks: tyro.conf.Positional[tuple[Path, ...]] = ()
    """Histories that are forecast. Default: each week of `history` from the sixth on, learned from
    the weeks before it."""
    timezone: str = "UTC"
    """Of the building, such as Europe/London: needed where the clock changes within the data."""
    out: Path = Path("out") / "forecast"
    """Directory to write to."""

    def __call__(self) -> int:
        """Learn, score, write, print."""
        from .forecast_study import run_forecast

        return run_forecast(self)
