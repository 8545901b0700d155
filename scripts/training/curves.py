"""`dynslam curves`: learning curves of several trainings, with their interval."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import tyro
from matplotlib.figure import Figure

from slam.benchmark.results import read
from slam.benchmark.statistics import Interval, interquartile_mean
from slam.errors import InputError

from ..console.output import write_png
from ..figures.style import ESTIMATE, MEDIUM, blank_figure, plain_axes

SHOWN = (("reward", "sum of rewards"), ("door_brier", "Brier of doors over time"))


@dataclass
class CurvesCommand:
    """Draw what several trainings had learned by when: each as a thin line, their interquartile
    mean with its bootstrap 95 % interval (Agarwal et al. 2021)."""

    folders: tyro.conf.Positional[tuple[Path, ...]]
    """What `dynslam train` wrote: trainings that differ in the seed."""
    out: Path = Path("curves.png")
    """The picture."""

    def __call__(self) -> int:
        """Read, draw, print."""
        runs = [read_run(folder) for folder in self.folders]
        if not runs:
            raise InputError("no training named: give the folders that dynslam train wrote")
        write_png(drawn(runs), self.out)
        steps = shared(runs)
        for name, title in SHOWN:
            value, low, high = at(runs, steps[-1], name)
            print(f"{title} after {steps[-1]:,} steps, {len(runs)} seeds: "
                  f"{value:.3f} ({low:.3f} to {high:.3f})")  # fmt: skip
        print(f"look at {self.out}")
        return 0


def read_run(folder: Path) -> list[dict[str, Any]]:
    """The evaluations of a training."""
    rows = read(folder / "progress.jsonl")
    if not rows or any(name not in row for row in rows for name in ("steps", *dict(SHOWN))):
        raise InputError(f"{folder}: no evaluations of a training in progress.jsonl")
    return rows


def shared(runs: Sequence[list[dict[str, Any]]]) -> list[int]:
    """The steps at which all were evaluated."""
    common = set.intersection(*({row["steps"] for row in rows} for rows in runs))
    if not common:
        raise InputError("these trainings were never evaluated after equally many steps")
    return sorted(common)


def at(runs: Sequence[list[dict[str, Any]]], steps: int, name: str) -> Interval:
    """What all had learned by then."""
    values = [row[name] for rows in runs for row in rows if row["steps"] == steps]
    return interquartile_mean(values)


def drawn(runs: Sequence[list[dict[str, Any]]]) -> Figure:
    """The picture."""
    figure, steps = blank_figure(8.0, 3.4), shared(runs)
    for k, (name, title) in enumerate(SHOWN, 1):
        axes = figure.add_subplot(1, 2, k)
        for rows in runs:
            axes.plot([row["steps"] / 1e3 for row in rows], [row[name] for row in rows],
                      color=ESTIMATE, linewidth=0.6, alpha=0.5)  # fmt: skip
        middle = np.array([at(runs, step, name) for step in steps])
        axes.plot(np.divide(steps, 1e3), middle[:, 0], color=ESTIMATE, linewidth=2.0)
        axes.fill_between(
            np.divide(steps, 1e3), middle[:, 1], middle[:, 2], color=ESTIMATE, alpha=0.2
        )
        axes.set_xlabel("thousand steps", fontsize=MEDIUM)
        axes.set_title(title, fontsize=MEDIUM)
        plain_axes(axes)
    return figure
