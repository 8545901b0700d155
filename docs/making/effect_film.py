"""The film of the effects of real lasers and wheels: one drive, four times, with an effect each."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium as gym
import numpy as np
from dynslam_cli.figures.film import Colours, write_film  # pyright: ignore[reportMissingImports]
from dynslam_cli.figures.style import (  # pyright: ignore[reportMissingImports]
    DOORS,
    ESTIMATE,
    INK,
    MEDIUM,
    PAPER,
    TRUTH,
    WALLS,
    blank_figure,
    rendered,
)
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from PIL import Image

from docs.making.sensor_picture import FANS, draw_scan, draw_world
from dynslam_env import (
    DoorWorldEnv,
    EchoLoss,
    Laser,
    MixedPixels,
    Slip,
    Surfaces,
    Sweep,
    WheelEncoders,
)
from slam.geometry import Pose2

SEED, START = 1, (1.6, 0.0, 0.0)  # of the episode; m, m, rad
FRAMES, STEPS_PER_FRAME, FRAMES_PER_SECOND = 22, 3, 5.0
FORWARD, WEAVE, PERIOD = 0.5, 0.2, 4.0  # actions: share of the velocities; s of a weave
WIDTH, HEIGHT, DPI = 9.6, 6.4, 75  # inches, inches, dots per inch
VIEW = (0.6, 8.6, -2.6, 2.6)  # m, of each panel
EXACT = np.array([to_rgb(each) for each in (PAPER, INK, TRUTH, ESTIMATE, WALLS, DOORS)])
COLOURS = Colours((255 * EXACT).round().astype(int), 14)


class Panel(NamedTuple):
    """An environment with one effect; whether its scans or its dead reckoning is drawn."""

    title: str
    parts: dict[str, Any]
    scans: bool = True


PANELS = (
    Panel("mixed pixels: echoes between two surfaces",
          {"laser": Laser(effects=(MixedPixels(0.0087, 3.0),), **FANS)}),
    Panel("a third of glass (light blue), a third dark (black)",
          {"laser": Laser(effects=(EchoLoss(reach=12.0), Surfaces(0.3, 0.3)), **FANS)}),
    Panel("a sweep of 0.1 s: scans bend where the robot turns",
          {"laser": Laser(effects=(Sweep(0.1),), **FANS)}),
    Panel("slip of 0.6 m: the way by the wheels, and the true one",
          {"odometry": WheelEncoders(), "faults": [Slip(0.6, at=3.0)]}, scans=False),
)  # fmt: skip


def effect_film(path: Path) -> None:
    """Film the four drives side by side."""
    envs = [_env(panel.parts) for panel in PANELS]
    ways = [[(env.pose, env.pose)] for env in envs]
    frames = []
    for frame in range(FRAMES):
        frames.append(_drawn(envs, ways))
        for step in range(STEPS_PER_FRAME):
            time = 0.1 * (frame * STEPS_PER_FRAME + step)
            weave = WEAVE * math.cos(math.tau * time / PERIOD)
            for env, way in zip(envs, ways, strict=True):
                env.step(np.array([FORWARD, weave], dtype=np.float32))
                way.append((env.pose, way[-1][1] @ env.displacement))
    write_film(frames, path, FRAMES_PER_SECOND, hold=1.0, colours=COLOURS)


def _env(parts: dict[str, Any]) -> DoorWorldEnv:
    env = gym.make("DoorCorridor-v0", doors="static", **parts).unwrapped
    assert isinstance(env, DoorWorldEnv)
    env.reset(seed=SEED, options={"start": START})
    return env


def _drawn(envs: list[DoorWorldEnv], ways: list[list[tuple[Pose2, Pose2]]]) -> Image.Image:
    figure = blank_figure(WIDTH, HEIGHT, DPI)
    axes = figure.subplots(2, 2)
    for axis, panel, env, way in zip(axes.flat, PANELS, envs, ways, strict=True):
        draw_world(axis, env)
        if panel.scans:
            draw_scan(axis, env)
        else:
            _draw_ways(axis, way)
        axis.set_title(panel.title, fontsize=MEDIUM, color=INK)
        axis.set(xlim=VIEW[:2], ylim=VIEW[2:])
    return rendered(figure)


def _draw_ways(axis: Axes, way: list[tuple[Pose2, Pose2]]) -> None:
    """The true way, and that by dead reckoning from the same start."""
    for poses, colour in zip(zip(*way, strict=True), (TRUTH, ESTIMATE), strict=True):
        axis.plot(*np.array(poses)[:, :2].T, color=colour, linewidth=2.0)
        axis.plot(*poses[-1][:2], "o", color=colour, markersize=5)
