"""The work of `dynslam belief`: the table of both beliefs, and their reliability plot."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from slam.benchmark.results import Result
from slam.errors import InputError
from slam.geometry import Array
from slam.metrics.trajectory import FAILURE_ATE
from slam.validation import unknown_name, whole_number

from ..console.output import own_directory
from ..figures.style import ESTIMATE, FAINT, MEDIUM, SMALL, TRUTH, blank_figure, plain_axes
from ..trials.pool import check_workers
from .belief_drive import BELIEFS, GROUPS, LAWS, drive
from .drives import run_drives, write_table

if TYPE_CHECKING:
    from .belief import BeliefCommand

WORLDS, AGENTS = ("loop", "office"), ("lookout", "longest-unseen", "round-robin")
ALL_AGENTS = "all agents"
RESAMPLES = 2000  # of drives, for intervals
HEADINGS = ("world, doors, agent", "looked at", "share, %", "old", "new", "best constant",
            "new - constant", "calibration error, old", "new")  # fmt: skip


def study_beliefs(options: BeliefCommand) -> int:
    """Run, write, print; the exit status."""
    whole_number("seeds", options.seeds, 1)
    whole_number("first", options.first, 0)
    check_workers(options.jobs)
    for law in options.laws:
        if law not in LAWS:
            raise InputError(unknown_name("law", law, LAWS))
    out = own_directory(options.out or Path("out") / "belief")
    tasks = [
        (world, law, agent, seed)
        for seed in range(options.first, options.first + options.seeds)
        for agent in options.agents or AGENTS
        for world in options.worlds or WORLDS
        for law in options.laws or LAWS
    ]
    rows, status = run_drives(drive, tasks, options.jobs, out, "belief")
    if rows:
        write_table(table(rows), out)
        reliability(rows, out / "reliability.png")
    return status


def table(rows: list[Result]) -> str:
    """Markdown: mean Brier scores by world, law, agent and group, with intervals over drives."""
    lines = [HEADINGS, ("---",) * len(HEADINGS)]
    cells: dict[tuple[str, str, str], list[Result]] = {}
    for row in rows:
        for agent in (ALL_AGENTS, row["agent"]):
            cells.setdefault((row["world"], row["law"], agent), []).append(row)
    for key, drives in sorted(cells.items()):
        lost = sum(row["ate"] > FAILURE_ATE for row in drives)
        name = f"{', '.join(key)} ({len(drives)} drives, {lost} lost)"
        sums = np.array([row["sums"] for row in drives])
        for g, group in enumerate(GROUPS):
            if sums[:, g].any():
                lines.append((name, group, *_line(sums, g)))
                name = ""
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def _line(sums: Array, group: int) -> tuple[str, ...]:
    """The scores of one group of drives `sums` (n, groups, beliefs, bins, 4)."""
    part = sums[:, group]
    share = part[:, 0, :, 0].sum() / sums[:, :, 0, :, 0].sum()
    old, new, gap = scores(part)
    drawn = np.random.default_rng(0).integers(len(part), size=(RESAMPLES, len(part)))
    with np.errstate(invalid="ignore", divide="ignore"):
        again = np.array([scores(part[rows]) for rows in drawn])
    low, high = np.nanpercentile(again, [2.5, 97.5], axis=0)
    errors = [f"{calibration_error(part[:, b].sum(axis=0)):.3f}" for b in range(len(BELIEFS))]
    return (
        f"{100 * share:.0f}",
        *(f"{v:.3f} ({low[k]:.3f} to {high[k]:.3f})" for k, v in enumerate((old, new))),
        f"{new - gap:.3f}",
        f"{gap:+.3f} ({low[2]:+.3f} to {high[2]:+.3f})",
        *errors,
    )


def scores(part: Array) -> tuple[float, float, float]:
    """Brier scores of both beliefs, and the second minus that of the best constant, from the sums
    (n, beliefs, bins, 4) of drives."""
    totals = part.sum(axis=(0, 2))
    count, _, shut, _ = totals[0]
    rate = shut / count
    old, new = totals[:, 3] / count
    return old, new, new - rate * (1.0 - rate)


def calibration_error(bins: Array) -> float:
    """Expected calibration error: |mean P - share closed| of bins (k, 4), weighted by counts."""
    count, p, shut, _ = bins.T
    return float(abs(p - shut).sum() / count.sum())


def reliability(rows: list[Result], path: Path) -> None:
    """Draw the share of closed doors against P(closed), for fresh and stale doors, by law."""
    laws = [law for law in LAWS if any(row["law"] == law for row in rows)]
    figure = blank_figure(3.2 * len(laws), 6.0)
    axes = figure.subplots(2, len(laws), squeeze=False)
    for column, law in enumerate(laws):
        sums = np.sum([row["sums"] for row in rows if row["law"] == law], axis=0)
        for line in range(2):
            one = axes[line, column]
            one.plot([0, 1], [0, 1], color=FAINT, linewidth=0.8)
            for b, colour in enumerate((ESTIMATE, TRUTH)):
                count, p, shut, _ = sums[line, b].T
                some = count > 0
                one.scatter(
                    p[some] / count[some], shut[some] / count[some], color=colour,
                    s=6.0 + 150.0 * count[some] / count.sum(), alpha=0.7,
                    label=f"{BELIEFS[b]}, error {calibration_error(sums[line, b]):.3f}",
                )  # fmt: skip
            one.set(xlim=(-0.05, 1.05), ylim=(-0.05, 1.05), aspect="equal")
            one.set_title(f"{GROUPS[line]}, {law} doors", fontsize=MEDIUM)
            one.set_xlabel("P(closed)", fontsize=SMALL)
            one.set_ylabel("share closed", fontsize=SMALL)
            one.legend(fontsize=SMALL, loc="lower right", markerscale=0.6)
            plain_axes(one)
    figure.savefig(path)
