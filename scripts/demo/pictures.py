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

from ..console.output import write_png
from ..figures.door_histogram import door_histogram_figure
from ..figures.known_poses import known
from ..figures.likelihood import likelihood_figure
from ..figures.map_figure import map_figure, overview_figure
from ..figures.map_panel import MapPanel
from ..figures.replay import Snapshot, take_snapshots, write_replay

SCANS_PER_FRAME = 5  # of the film
MAP_FIGURES = {  # number in the paper -> variant and doors
    4: ("odometry", "static"),
    5: ("static-ml", "static"),
    6: ("static-ml", "moving"),
    7: ("dynamic-ml", "moving"),
}


def write_pictures(static: Episode, moving: Episode, out: Path) -> Iterator[Path]:
    """Write all pictures of a pair of episodes into `out`; yields each path when it is written."""
    episodes = {"static": static, "moving": moving}
    runs = {
        number: _run(variant, episodes[doors]) for number, (variant, doors) in MAP_FIGURES.items()
    }
    panels = {
        number: _panel(f"Figure {number}: {variant}, {doors} doors", runs[number], episodes[doors])
        for number, (variant, doors) in MAP_FIGURES.items()
    }
    yield _png(door_histogram_figure(moving), out / "figure1-histogram.png")
    yield _png(likelihood_figure(static, moving), out / "figure2-3-likelihood.png")
    for number, panel in panels.items():
        figure = map_figure(panel.grid, panel.poses, panel.truth, panel.scan, panel.title)
        yield _png(figure, out / f"figure{number}-map.png")
    yield _png(overview_figure(list(panels.values())), out / "figures4-7.png")
    write_replay(out / "replay.gif", moving, {"static ML": runs[6], "dynamic ML": runs[7]})
    yield out / "replay.gif"


def _run(variant: str, episode: Episode) -> list[Snapshot]:
    robot = slam.make(variant, true_start(episode), seed=0)
    return take_snapshots(robot, episode, SCANS_PER_FRAME)


def _panel(title: str, run: list[Snapshot], episode: Episode) -> MapPanel:
    last = run[-1]
    error = ate(np.asarray(last.poses), known(episode).poses)
    return MapPanel(
        f"{title}, this drive's ATE {1e3 * error:.0f} mm", last.grid, last.poses, episode.truth
    )


def _png(figure: Figure, path: Path) -> Path:
    write_png(figure, path)
    return path
