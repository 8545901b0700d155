"""Learning curves of several trainings."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from slam.benchmark.results import read
from slam.benchmark.statistics import Interval, interquartile_mean
from slam.errors import InputError

from ..console.output import write_png
from ..figures.style import ESTIMATE, MEDIUM, blank_figure, plain_axes
from .curves import CurvesCommand

DOOR_CURVE = "door_brier"
CURVES = (("reward", "sum of rewards"), (DOOR_CURVE, "Brier of doors over time"))
"""Scores and titles; trainings of viewpoints have no sum of rewards."""


def draw_curves(command: CurvesCommand) -> int:
    """Read the trainings, draw the picture, print the final scores."""
    runs = [read_run(folder) for folder in command.folders]
    if not runs:
        raise InputError("no training named: give directories of dynslam train")
    write_png(learning_curves(runs), command.out)
    steps = common_steps(runs)
    for name, title in _told(runs):
        value, low, high = score_at(runs, steps[-1], name)
        print(f"{title} after {steps[-1]:,} steps, {len(runs)} seeds: "
              f"{value:.3f} ({low:.3f} to {high:.3f})")  # fmt: skip
    print(f"look at {command.out}")
    return 0


def read_run(folder: Path) -> list[dict[str, Any]]:
    """The evaluations of a training."""
    rows = read(folder / "progress.jsonl")
    if not rows or any(name not in row for row in rows for name in ("steps", DOOR_CURVE)):
        raise InputError(f"{folder}: no evaluations of a training in progress.jsonl")
    return rows


def common_steps(runs: Sequence[list[dict[str, Any]]]) -> list[int]:
    """The steps at which all trainings were evaluated."""
    common = set.intersection(*({row["steps"] for row in rows} for rows in runs))
    if not common:
        raise InputError("no number of steps at which all these trainings were evaluated")
    return sorted(common)


def score_at(runs: Sequence[list[dict[str, Any]]], steps: int, name: str) -> Interval:
    """Interquartile mean of the score `name` after `steps`, with its interval."""
    values = [row[name] for rows in runs for row in rows if row["steps"] == steps]
    return interquartile_mean(values)


def learning_curves(runs: Sequence[list[dict[str, Any]]]) -> Figure:
    """A figure with one panel per score."""
    curves, steps = _told(runs), common_steps(runs)
    figure = blank_figure(4.0 * len(curves), 3.4)
    for k, (name, title) in enumerate(curves, 1):
        axes = figure.add_subplot(1, len(curves), k)
        for rows in runs:
            axes.plot([row["steps"] / 1e3 for row in rows], [row[name] for row in rows],
                      color=ESTIMATE, linewidth=0.6, alpha=0.5)  # fmt: skip
        middle = np.array([score_at(runs, step, name) for step in steps])
        axes.plot(np.divide(steps, 1e3), middle[:, 0], color=ESTIMATE, linewidth=2.0)
        axes.fill_between(
            np.divide(steps, 1e3), middle[:, 1], middle[:, 2], color=ESTIMATE, alpha=0.2
        )
        axes.set_xlabel("thousand steps", fontsize=MEDIUM)
        axes.set_title(title, fontsize=MEDIUM)
        plain_axes(axes)
    return figure


def _told(runs: Sequence[list[dict[str, Any]]]) -> list[tuple[str, str]]:
    """The CURVES that every evaluation of every training has."""
    rows = [row for rows in runs for row in rows]
    return [curve for curve in CURVES if all(curve[0] in row for row in rows)]
