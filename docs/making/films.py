"""Films of the environments: the first minutes of a drive in each, and of a real laser."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from dynslam_cli.figures.film import Colours, write_film  # pyright: ignore[reportMissingImports]
from PIL import Image

from dynslam_env import PATROLS, WORLDS, EchoLoss, Laser, MixedPixels, Surfaces, Sweep
from dynslam_env.drawing import colours

SEED = 7  # of the drives
FRAMES = 32
SECONDS_PER_FRAME = dict.fromkeys((*WORLDS, *PATROLS), 1.0) | {
    "DoorOffice-v0": 2.0, "DoorLoop-v0": 2.0, "DoorWings-v0": 2.0,
    "DoorPatrolGoals-v0": 4.0, "DoorPatrol-v1": 2.0,
}  # fmt: skip
FRAMES_PER_SECOND = 8.0
LARGEST = (500, 320)  # pixels, of a frame
DRAWN = np.array([
    colours.PAPER, colours.SOLID, colours.FACE, colours.INK, colours.FAINT, colours.GREY,
    colours.UNKNOWN, colours.BLUE, colours.VERMILION, colours.ORANGE, colours.SKY, colours.GREEN,
    colours.PURPLE, colours.LIT, colours.BEAM,
])  # fmt: skip
COLOURS = Colours(np.vstack([DRAWN, (DRAWN + 255) // 2]), mixed=24)  # pure, and on edges: with
# mixed ones alone, leaves and robot turn grey
REAL_LASER = Laser(
    sigma=0.02, effects=(MixedPixels(), EchoLoss(reach=8.0), Surfaces(glass=0.3), Sweep(0.1))
)


def film(name: str, driver: Callable[[Any], Callable[[Any], Any]], path: Path) -> None:
    """Film a drive in a world of dynslam."""
    _film(name, {}, SECONDS_PER_FRAME[name], driver, path)


def film_of_effects(driver: Callable[[Any], Callable[[Any], Any]], path: Path) -> None:
    """Film the scans of a laser that mixes, loses and distorts, near the robot."""
    _film("DoorCorridor-v0", {"laser": REAL_LASER}, 0.5, driver, path)


def _film(
    name: str, parts: dict[str, Any], pace: float, driver: Callable[[Any], Callable[[Any], Any]],
    path: Path,
) -> None:  # fmt: skip
    env: Any = gym.make(name, render_mode="rgb_array", max_episode_steps=-1, **parts)
    observation, info = env.reset(seed=SEED)
    action, frames = driver(env), []
    while len(frames) < FRAMES:
        if info["time"] >= pace * len(frames):
            frames.append(_small(env.render()))
        observation, _, _, _, info = env.step(action(observation))
    env.close()
    write_film(frames, path, FRAMES_PER_SECOND, 1.0, COLOURS)


def _small(pixels: np.ndarray) -> Image.Image:
    picture = Image.fromarray(pixels)
    picture.thumbnail(LARGEST)
    return picture


FILMS = {f"worlds/{name}.gif": partial(film, name) for name in SECONDS_PER_FRAME} | {
    "worlds/real-laser.gif": film_of_effects
}
"""Path within docs -> draws it, given the driver of an environment."""
