"""`python -m docs.making.pictures`: draws the site's pictures of environments and maps.

Arguments name the files to draw, such as worlds/DoorLoop-v0.png; without arguments, all.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from dynslam_cli.figures.lost_course import LostCourse  # pyright: ignore[reportMissingImports]
from dynslam_cli.figures.map_figure import (  # pyright: ignore[reportMissingImports]
    map_figure,
    overview_figure,
)
from dynslam_cli.figures.map_panel import MapPanel  # pyright: ignore[reportMissingImports]
from PIL import Image

import agents
import slam
from agents import ScriptedPath, record_path
from docs.examples import map_a_log
from docs.making.cards import ids
from docs.making.effect_film import effect_film
from docs.making.films import FILMS
from docs.making.sensor_picture import sensors
from docs.making.split_pictures import test_worlds
from dynslam_env import CarriedAway
from dynslam_env.reset_options import DIFFICULTIES
from slam.benchmark.run import run, true_start

DOCS = Path(__file__).parents[1]
SEED, SECONDS = 7, 12.0  # of the drives in the environments, until the picture is taken
RECORDED = 5000  # the seed of the pages' recorded drives
DPI = 80


def environment(env_id: str, path: Path) -> None:
    """Draw an environment `SECONDS` after its reset: the truth, and the map if it has a SLAM."""
    env: gym.Env[Any, Any] = gym.make(env_id, render_mode="rgb_array")
    observation, info = env.reset(seed=SEED)
    action = driver(env)
    while info["time"] < SECONDS:
        observation, _, _, _, info = env.step(action(observation))
    pixels = env.render()
    env.close()
    assert isinstance(pixels, np.ndarray)
    Image.fromarray(pixels).save(path, optimize=True)


def driver(env: gym.Env[Any, Any]) -> Callable[[Any], Any]:
    """A policy: along the path of a world; on a patrol, to the largest information gain."""
    if isinstance(env.action_space, gym.spaces.Discrete):
        return lambda observation: int(np.flatnonzero(observation["action_mask"])[-1])
    place: Any = env.unwrapped
    if hasattr(place, "wrapped"):
        agent: Any = agents.make("information-gain", env)
    else:
        agent = ScriptedPath(place.layout.path, lambda: place.pose, place.robot)
    return lambda observation: agent.predict(observation)[0]


def loop_map(path: Path) -> None:
    """Draw the map that `dynslam run` draws in the tutorial."""
    episode = record_path("DoorLoop-v0", RECORDED)
    done = run(slam.make("hmm-ml"), episode)
    title = f"DoorLoop-v0-{RECORDED}.log.gz, hmm-ml"
    course = LostCourse(episode.times, done.lost)
    map_figure(done.grid, done.poses, title=title, lost=course).savefig(path, dpi=DPI)


def lost_map(path: Path) -> None:
    """Draw the map of a drive during which the robot is carried to another place."""
    episode = record_path("DoorOffice-v0", RECORDED, faults=[CarriedAway()])
    done = run(slam.make("static-ml"), episode)
    title = "DoorOffice-v0, carried away, static-ml"
    course = LostCourse(episode.times, done.lost)
    map_figure(done.grid, done.poses, title=title, lost=course).savefig(path, dpi=DPI)


def map_without_doors(path: Path) -> None:
    """Draw the first and the last map of the example `map_a_log`."""
    episode = record_path("DoorCorridor-v0", RECORDED, doors="moving")
    slam.register("without-doors", map_a_log.without_doors)
    panels = []
    for name in (map_a_log.VARIANTS[0], map_a_log.VARIANTS[-1]):
        done = run(slam.make(name, start=true_start(episode)), episode)
        panels.append(MapPanel(name, done.grid, done.poses))
    overview_figure(panels).savefig(path, dpi=DPI)


PICTURES: dict[str, Callable[[Path], None]] = {
    **{f"worlds/{name}.png": partial(environment, name) for name in ids()},
    "loop-map.png": loop_map,
    "lost-map.png": lost_map,
    "map-a-log.png": map_without_doors,
    "sensors.png": sensors,
    "effects.gif": effect_film,
    **{name: partial(draw, driver) for name, draw in FILMS.items()},
    **{f"worlds-{level}.png": partial(test_worlds, level) for level in DIFFICULTIES},
}


if __name__ == "__main__":
    for picture in sys.argv[1:] or PICTURES:
        PICTURES[picture](DOCS / picture)
