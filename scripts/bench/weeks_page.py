"""report.html of the suite `weeks`: the tables, and each door's calendar beside the truth."""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from matplotlib.figure import Figure

from slam.benchmark.results import Result

from ..console.html_page import filled_in
from ..figures.door_weeks import door_weeks
from .weeks import WeeksTrial
from .weeks_table import WeeksTable

TEMPLATES = Path(__file__).parents[1] / "report"


class Calendar(NamedTuple):
    """The doors of one campaign.

    title  world, campaign and variant
    image  data URL of a PNG
    """

    title: str
    image: str


def weeks_page(
    rows: Sequence[Result], tables: Sequence[WeeksTable], trials: Sequence[WeeksTrial]
) -> str:
    """The page: one file without network requests. Of each world it shows the doors of the first
    campaign, as the last variant remembers them."""
    failed = sum(row["error"] is not None for row in rows)
    calendars = _calendars(rows, trials)
    return filled_in(
        TEMPLATES, "weeks.html", runs=len(rows), failed=failed, tables=tables, calendars=calendars
    )


def _calendars(rows: Sequence[Result], trials: Sequence[WeeksTrial]) -> list[Calendar]:
    weeks = {row["run"]: row["weeks"] for row in rows if row.get("weeks")}
    shown: dict[str, WeeksTrial] = {}
    for trial in trials:
        first = shown.get(trial.env)
        if trial.row()["run"] in weeks and (first is None or first.seed == trial.seed):
            shown[trial.env] = trial
    return [_calendar(trial, weeks[trial.row()["run"]]) for trial in shown.values()]


def _calendar(trial: WeeksTrial, weeks: list) -> Calendar:
    campaign = trial.campaign()
    truths = [campaign.week(number) for number in range(len(weeks))]
    title = f"Doors of {trial.row()['world']}, campaign {trial.seed}, as {trial.variant} remembers"
    return Calendar(title, _data_url(door_weeks(truths, weeks)))


def _data_url(figure: Figure) -> str:
    file = io.BytesIO()
    figure.savefig(file, format="png")
    return "data:image/png;base64," + base64.b64encode(file.getvalue()).decode()
