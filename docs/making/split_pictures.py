"""The pictures of test worlds: for each difficulty, the first ten of four environments."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from dynslam_cli.figures.style import (  # pyright: ignore[reportMissingImports]
    DOORS,
    ESTIMATE,
    FAINT,
    INK,
    MEDIUM,
    blank_figure,
)
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from PIL import Image

from dynslam_env import DoorWorldEnv
from slam.geometry import Array

SHOWN = ("DoorCorridor-v0", "DoorLoop-v0", "DoorOffice-v0", "DoorWings-v0")
COUNT = 10  # test worlds of each
COLOURS = 64  # of a picture


def test_worlds(difficulty: str, path: Path) -> None:
    """Draw the first test worlds of this difficulty: a row each environment, an index a column."""
    figure = blank_figure(1.5 * COUNT, 1.5 * len(SHOWN))
    figure.set_layout_engine("constrained", w_pad=0.01, h_pad=0.01, wspace=0.0, hspace=0.0)
    axes = figure.subplots(len(SHOWN), COUNT)
    for name, row in zip(SHOWN, axes, strict=True):
        env: Any = gym.make(name, difficulty=difficulty).unwrapped
        for index, axis in enumerate(row):
            env.reset(options={"split": "test", "index": index})
            _world(axis, env)
        row[0].set_ylabel(name.removesuffix("-v0"), fontsize=MEDIUM, color=INK)
    figure.savefig(path, dpi=90)
    few = Image.open(path).convert("RGB").quantize(COLOURS, Image.Quantize.FASTOCTREE)
    few.save(path, optimize=True)


def _world(axis: Axes, env: DoorWorldEnv) -> None:
    """Walls, doors and people as they begin, the path, and the start."""
    _lines(axis, np.hstack([env.layout.path[:-1], env.layout.path[1:]]), FAINT, 1.0)
    _lines(axis, env.layout.walls, INK, 0.8)
    _lines(axis, env.outline(), DOORS, 1.4)
    axis.plot(*env.pose[:2], "o", color=ESTIMATE, markersize=4)
    axis.set(aspect="equal", xticks=[], yticks=[])
    axis.autoscale_view()
    for side in axis.spines.values():
        side.set_visible(False)


def _lines(axis: Axes, segments: Array, colour: str, width: float) -> None:
    axis.add_collection(
        LineCollection(list(segments.reshape(-1, 2, 2)), colors=colour, linewidths=width)
    )
