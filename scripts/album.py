"""The demo's pictures: the paper's figures 1 to 7, and the film of one episode."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import slam
from slam.benchmark.run import true_start
from slam.episode import Episode
from slam.metrics.trajectory import ate

from .figures.door_histogram import door_histogram_figure
from .figures.known_poses import known
from .figures.likelihood import likelihood_figure
from .figures.map_figure import map_figure
from .figures.map_panel import MapPanel
from .figures.overview import overview_figure
from .figures.replay import write_replay
from .figures.snapshots import Snapshot, take_snapshots
from .output import write_png

EVERY = 5  # scans between two frames of the film


def write_album(static: Episode, moving: Episode, out: Path) -> Iterator[Path]:
    """Write all pictures of a pair of episodes into `out`; gives each path when it is written."""
    runs = {
        (variant, doors): _run(variant, episode)
        for variant, doors, episode in (
            ("odometry", "static", static),
            ("static-ml", "static", static),
            ("static-ml", "moving", moving),
            ("dynamic-ml", "moving", moving),
        )
    }
    panels = [
        _panel(f"Figure {number}: {variant}, {doors} doors", runs[variant, doors][-1], episode)
        for number, variant, doors, episode in (
            (4, "odometry", "static", static),
            (5, "static-ml", "static", static),
            (6, "static-ml", "moving", moving),
            (7, "dynamic-ml", "moving", moving),
        )
    ]
    yield _png(door_histogram_figure(moving), out / "figure1-histogram.png")
    yield _png(likelihood_figure(static, moving), out / "figure2-3-likelihood.png")
    for number, panel in enumerate(panels, start=4):
        figure = map_figure(panel.grid, panel.poses, panel.truth, panel.scan, panel.title)
        yield _png(figure, out / f"figure{number}-map.png")
    yield _png(overview_figure(panels), out / "figures4-7.png")
    film = {
        "static ML": runs["static-ml", "moving"],
        "dynamic ML": runs["dynamic-ml", "moving"],
    }
    write_replay(out / "replay.gif", moving, film)
    yield out / "replay.gif"


def _run(variant: str, episode: Episode) -> list[Snapshot]:
    robot = slam.make(variant, true_start(episode), seed=0)
    return take_snapshots(robot, episode, EVERY)


def _panel(title: str, last: Snapshot, episode: Episode) -> MapPanel:
    error = ate(np.asarray(last.poses), known(episode).poses)
    return MapPanel(f"{title}, ATE {1e3 * error:.0f} mm", last.grid, last.poses, episode.truth)


def _png(figure: Figure, path: Path) -> Path:
    write_png(figure, path)
    return path
