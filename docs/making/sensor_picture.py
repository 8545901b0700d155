"""The picture of the effects of real lasers: one scan of one place, with an effect each."""

from __future__ import annotations

import math
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
    TRUTH,
    WALLS,
    blank_figure,
)
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection

from dynslam_env import (
    DoorWorldEnv,
    EchoLoss,
    Laser,
    MixedPixels,
    Quantisation,
    RangeNoise,
    Surfaces,
    Sweep,
)
from dynslam_env.sensors.effect_scanner import EffectScanner
from dynslam_env.sensors.laser import Scanner
from dynslam_env.sensors.materials import DARK, GLASS
from slam.geometry import Array

SEED, START = 1, (3.4, 0.0, -0.9)  # of the episode; m, m, rad
STEPS, TURN = 12, 0.35  # of the turn on the spot; share of the largest turning velocity
WRONG = 0.05  # m of error from which an echo is drawn as wrong
FANS: dict[str, Any] = {"beams": 361, "sigma": 0.005}
PANELS: dict[str, Laser | str] = {
    "Laser(beams=361)": Laser(beams=361),
    "MixedPixels(0.0087, 3.0)": Laser(effects=(MixedPixels(0.0087, 3.0),), **FANS),
    "Surfaces(glass=0.3, dark=0.3), EchoLoss(12)": Laser(
        effects=(EchoLoss(reach=12.0), Surfaces(glass=0.3, dark=0.3)), **FANS
    ),
    "RangeNoise(linear=0.02), Quantisation(0.05)": Laser(
        effects=(RangeNoise(linear=0.02), Quantisation(0.05)), **FANS
    ),
    "Sweep(0.1), turning at 1.8 rad/s": Laser(effects=(Sweep(0.1),), **FANS),
    '"SICK-LMS200"': "SICK-LMS200",
}


def sensors(path: Path) -> None:
    """Draw the same place and time with each of PANELS."""
    figure = blank_figure(11.0, 6.2)
    axes = figure.subplots(2, 3)
    for axis, (title, laser) in zip(axes.flat, PANELS.items(), strict=True):
        env = _env_with(laser)
        draw_world(axis, env)
        draw_scan(axis, env)
        x, y, _ = env.pose
        axis.set(xlim=(x - 1.5, x + 8.5), ylim=(y - 3.5, y + 3.5))
        axis.set_title(title, fontsize=MEDIUM, color=INK)
    figure.savefig(path, dpi=80)


def _env_with(laser: Laser | str) -> DoorWorldEnv:
    env = gym.make("DoorCorridor-v0", laser=laser, doors="static").unwrapped
    assert isinstance(env, DoorWorldEnv)
    env.reset(seed=SEED, options={"start": START})
    for _ in range(STEPS):
        env.step(np.array([0.0, TURN], dtype=np.float32))
    return env


def draw_world(axis: Axes, env: DoorWorldEnv) -> None:
    """Walls, panels of glass and dark ones, leaves, and the robot."""
    physics, scanner = env.physics, env.scanner
    _lines(axis, physics.segments[: physics.first_edge], INK, 1.2)
    _lines(axis, env.outline(), DOORS, 1.5)
    if isinstance(scanner, EffectScanner) and scanner.panels is not None:
        panels = scanner.panels
        _lines(axis, panels.segments[panels.codes == GLASS], WALLS, 3.5)
        _lines(axis, panels.segments[panels.codes == DARK], INK, 3.5)
    x, y, theta = env.pose
    axis.plot(x, y, "o", color=INK, markersize=6)
    axis.plot([x, x + 0.5 * math.cos(theta)], [y, y + 0.5 * math.sin(theta)], color=INK)
    axis.set(aspect="equal", xticks=[], yticks=[])


def draw_scan(axis: Axes, env: DoorWorldEnv) -> None:
    """The last scan: right echoes, wrong ones, and beams without an echo."""
    scan, physics = env.scan, env.physics
    laser, place = env.world_config.laser, env.pose @ scan.mount
    truth = Scanner(laser, np.random.default_rng(0)).exact(env.pose, physics.segments)
    turned = place.theta + scan.angles
    with np.errstate(invalid="ignore"):
        ends = np.column_stack([place.x + scan.ranges * np.cos(turned),
                                place.y + scan.ranges * np.sin(turned)])  # fmt: skip
        wrong = np.abs(scan.ranges - truth) > WRONG
    for which, colour in ((~wrong & scan.hit, TRUTH), (wrong & scan.hit, ESTIMATE)):
        axis.plot(*ends[which].T, ".", color=colour, markersize=3.5)
    silent = np.flatnonzero(scan.no_echo)
    far = np.column_stack([place.x + 8 * np.cos(turned), place.y + 8 * np.sin(turned)])[silent]
    starts = np.tile([place.x, place.y], (len(far), 1))
    _lines(axis, np.hstack([starts, far]), FAINT, 0.4)


def _lines(axis: Axes, segments: Array, colour: str, width: float) -> None:
    axis.add_collection(
        LineCollection(list(segments.reshape(-1, 2, 2)), colors=colour, linewidths=width)
    )
