"""Whether the variants know that they are lost: scores of groups of runs, a table, a diagram."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from rich.box import HORIZONTALS
from rich.table import Table as TerminalTable

from slam.benchmark.results import Result
from slam.benchmark.statistics import Interval, median, share
from slam.metrics.lost import (
    LOST_DISTANCE,
    LOST_TURN,
    TOLD_IN_TIME,
    Loss,
    Reliability,
    auroc_of_counts,
    calibration_error,
    had_time,
    pooled,
    told_in_time,
)

from ..figures.style import FAINT, MEDIUM, SMALL, blank_figure, plain_axes
from .charts import MARKERS, Chart, colour
from .summary import Summary
from .tables import Cell, Table

FAULT_FACTOR = "fault"
"""Factor of the conditions whose table is printed in the terminal, too."""
ALL = "all conditions"
MIN_SCANS = 50  # of a bin that the diagram shows
WRONG_POSE = f"more than {LOST_DISTANCE:g} m or {math.degrees(LOST_TURN):g} deg off within the map"


class LostSummary(NamedTuple):
    """How well a group of runs told that they were lost; all but `runs` may be NaN.

    runs           number of runs
    at_end         %, of the runs, lost at the end or without a result, with Wilson's interval
    wrong          %, of the scans, with a wrong pose
    sure           %, of the scans, with a wrong pose that the SLAM did not tell
    told           %, of the losses that began at least TOLD_IN_TIME before the end, told or
                   corrected within that time, with Wilson's interval
    notice         s, median from the beginning of a loss until it was told, of those that were told
    found          %, of the losses, after which the pose was right again
    recover        s, median from the beginning of those losses to their end
    false_alarms   an hour during which the pose was right
    auroc          area under the ROC curve, of all scans
    error          expected calibration error
    brier          mean squared difference of `lost` and the truth
    """

    runs: int
    at_end: Interval
    wrong: float
    sure: float
    told: Interval
    notice: float
    found: float
    recover: float
    false_alarms: float
    auroc: float
    error: float
    brier: float


def lost_summary(rows: Sequence[Result]) -> LostSummary:
    """The scores of some runs together."""
    known = _with_lost(rows)
    scores = [row["lost"] for row in known]
    losses = [Loss(**loss) for score in scores for loss in score["losses"]]
    ended = [loss.end - loss.begin for loss in losses if loss.end is not None]
    told = [loss.told - loss.begin for loss in losses if loss.told is not None]
    ranks = [[score["ranks"][kind] for score in scores] for kind in ("right", "wrong")]
    diagram = _pooled(known)
    return LostSummary(
        runs=len(rows),
        at_end=_percent([r.get("lost", {}).get("lost_at_end", True) for r in rows]),
        wrong=100 * _mean(known, "lost_share"),
        sure=100 * _mean(known, "sure_and_wrong"),
        told=_percent([told_in_time(loss) for loss in losses if had_time(loss)]),
        notice=median(told).value,
        found=100 * len(ended) / len(losses) if losses else math.nan,
        recover=median(ended).value,
        false_alarms=_rate(scores),
        auroc=auroc_of_counts(*(np.sum(counts, axis=0) for counts in ranks)) if known else math.nan,
        error=calibration_error(diagram) if known else math.nan,
        brier=_mean(known, "brier"),
    )


def _with_lost(rows: Sequence[Result]) -> list[Result]:
    return [row for row in rows if row.get("lost") is not None]


def _pooled(rows: Sequence[Result]) -> Reliability:
    return pooled([Reliability(**row["lost"]["reliability"]) for row in _with_lost(rows)])


def _percent(events: Sequence[bool]) -> Interval:
    return Interval(*(100 * number for number in share(events)))


def _mean(rows: Sequence[Result], name: str) -> float:
    """Mean over all scans of the runs."""
    if not rows:
        return math.nan
    return float(np.average([r["lost"][name] for r in rows], weights=[r["scans"] for r in rows]))


def _rate(scores: Sequence[Result]) -> float:
    hours = sum(score["hours_right"] for score in scores)
    return sum(score["false_alarms"] for score in scores) / hours if hours else math.nan


# -- the table ---------------------------------------------------------------------------------

COLUMNS = (
    ("lost at the end, %", 0),
    ("wrong, % of scans", 1),
    ("sure and wrong, % of scans", 1),
    (f"told or corrected within {TOLD_IN_TIME:g} s, % of losses that left the time", 0),
    ("time to notice, s", 1),
    ("found again, % of losses", 0),
    ("time to recover, s", 1),
    ("false alarms an hour", 1),
    ("AUROC", 3),
    ("calibration error", 3),
    ("Brier", 3),
)
"""Headings and decimals of the fields of `LostSummary` after `runs`."""

EVENTS = {"at_end": ("lost", "end %"), "sure": ("sure,", "wrong"), "told": ("told", "5 s %"),
          "notice": ("told", "s"), "found": ("found", "%"), "recover": ("found", "s"),
          "false_alarms": ("false", "an h")}  # fmt: skip
"""Fields of `LostSummary` in the terminal's table of faults, with two lines of heading each."""

PROBABILITIES = {"wrong": ("wrong,", "% of scans"), "auroc": ("", "AUROC"),
                 "error": ("calibration", "error"), "brier": ("", "Brier")}  # fmt: skip
"""Those in its table of variants."""

DIGITS = dict(zip(LostSummary._fields[1:], (digits for _, digits in COLUMNS), strict=True))
CAPTION = (
    f"A pose is wrong where the online estimate is {WRONG_POSE}: in relation to the first scan "
    "that was drawn within 1.5 m of it. Lost at the end is a last pose as far off in the world. A "
    "SLAM tells that it is lost "
    "where Estimate.lost is above 0.5; sure and wrong: a wrong pose that it does not tell. Losses "
    "are times with a wrong pose, at least 2 s apart; a false alarm is one during which no pose "
    "was wrong. Probabilities are judged scan by scan, over all runs of a line together; AUROC is "
    "the area under the ROC curve. A run without a result counts as lost at the end."
)


def lost_table(summary: Summary) -> Table:
    """A line per condition and variant, and one per variant for all conditions together; empty
    where no pose was wrong and no SLAM told that it was lost."""
    headings = ["condition", summary.wording.compared, "runs", *(name for name, _ in COLUMNS)]
    lines = [*_overall(summary), *((str(g.condition), g.variant, g.rows)
                                   for c in summary.conditions for g in summary.of(c))]  # fmt: skip
    rows = []
    for condition, variant, group in lines if _worth_telling(summary.rows) else ():
        runs, *values = lost_summary(group)
        cells = [_cell(value, digits) for value, (_, digits) in zip(values, COLUMNS, strict=True)]
        words = (Cell(condition, condition), Cell(variant, variant), Cell(str(runs), float(runs)))
        rows.append([*words, *cells])
    return Table("lost", "Does it know that it is lost?", CAPTION, headings, rows)


def _overall(summary: Summary) -> list[tuple[str, str, list[Result]]]:
    """The runs of each variant, with a name for all conditions; nothing where there is only one."""
    if len(summary.conditions) < 2:
        return []
    return [(ALL, name, [row for row in summary.rows if row["variant"] == name])
            for name in summary.variants]  # fmt: skip


def _worth_telling(rows: Sequence[Result]) -> bool:
    known = [row["lost"] for row in _with_lost(rows)]
    return any(score["losses"] or max(score["reliability"]["told"]) > 0 for score in known)


def _cell(value: float | Interval, digits: int) -> Cell:
    number = value.value if isinstance(value, Interval) else value
    if math.isnan(number):
        return Cell("-", None)
    text = f"{number:.{digits}f}"
    if isinstance(value, Interval):
        text += f" ({value.low:.{digits}f} to {value.high:.{digits}f})"
    return Cell(text, number)


def lost_terminal(rows: Sequence[Result], order: Sequence[str]) -> list[TerminalTable]:
    """Two tables for a terminal of 80 columns, over all worlds: what happened by fault and variant,
    and how good the probabilities of each variant are; empty without faults."""
    faulty = [row for row in rows if FAULT_FACTOR in row["condition"]]
    if not faulty:
        return []
    faults = dict.fromkeys(row[FAULT_FACTOR] for row in faulty)
    variants = {name: [row for row in faulty if row["variant"] == name] for name in order}
    events = _terminal(("fault", "variant"), EVENTS)
    events.caption, events.caption_justify = CAPTION, "left"
    for fault in faults:
        for name, own in variants.items():
            group = [row for row in own if row[FAULT_FACTOR] == fault]
            events.add_row(fault, name, *_short(group, EVENTS), end_section=name == order[-1])
    overall = _terminal(("variant",), PROBABILITIES)
    for name, own in variants.items():
        overall.add_row(name, *_short(own, PROBABILITIES))
    return [events, overall]


def _terminal(words: Sequence[str], fields: Mapping[str, tuple[str, str]]) -> TerminalTable:
    table = TerminalTable(box=HORIZONTALS, padding=0)
    for word in words:
        table.add_column(f"\n{word}", no_wrap=True)
    for above, below in fields.values():
        table.add_column(f"{above}\n{below}", no_wrap=True)
    return table


def _short(rows: Sequence[Result], fields: Mapping[str, tuple[str, str]]) -> list[str]:
    """The fields of a group without their intervals."""
    found = lost_summary(rows)._asdict()
    values = {name: v.value if isinstance(v, Interval) else v for name, v in found.items()}
    return [_cell(values[name], DIGITS[name]).text for name in fields]


# -- the reliability diagram -------------------------------------------------------------------


def reliability_chart(summary: Summary) -> Chart | None:
    """The diagram of all scans of each variant; None where no SLAM told anything."""
    figure = blank_figure(4.6, 4.4)
    axes, drawn = figure.add_subplot(), 0
    axes.plot([0, 1], [0, 1], color=FAINT, linewidth=1.0)
    for name in summary.variants:
        rows = _with_lost([row for row in summary.rows if row["variant"] == name])
        if not rows or max(_pooled(rows).told) == 0.0:
            continue
        scans, told, wrong = map(np.array, _pooled(rows))
        some = scans >= MIN_SCANS
        error = calibration_error(_pooled(rows))
        axes.plot(told[some], wrong[some], color=colour(summary, name), linewidth=1.2,
                  marker=MARKERS[drawn % len(MARKERS)], markersize=4,
                  label=f"{name} (ECE {error:.3f})")  # fmt: skip
        drawn += 1
    if not drawn:
        return None
    axes.set(xlim=(-0.02, 1.02), ylim=(-0.02, 1.02), aspect="equal")
    axes.set_xlabel("Estimate.lost", fontsize=MEDIUM)
    axes.set_ylabel("share of scans with a wrong pose", fontsize=MEDIUM)
    plain_axes(axes)
    axes.legend(frameon=False, fontsize=SMALL, loc="lower right")
    caption = (
        f"The scans of all runs by Estimate.lost (ten bins, of {MIN_SCANS} scans or more) against "
        f"the share of them whose pose was {WRONG_POSE}; a calibrated SLAM is on the diagonal. "
        "ECE: expected calibration error."
    )
    return Chart("lost-reliability", "Reliability of Estimate.lost", caption, figure)
