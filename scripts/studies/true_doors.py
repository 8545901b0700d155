"""The true doors of a simulated drive, and what the scans saw of them."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np

from dynslam_env import DoorWorldEnv
from slam.episode import Episode
from slam.geometry import Array, Pose2, transform_points
from slam.metrics.ghosts import seen_through

MIN_SIGHTINGS = 5  # scans that saw a door in a state, for it to count as seen so
MAX_LEAF_DISTANCE = 0.08  # m of an echo from the middle of the closed leaf
UNSEEN, OPEN, CLOSED, BOTH = "unseen", "open", "closed", "both"


def middles(env_id: str, seed: int, law: str, parameters: dict[str, Any]) -> Array:
    """(d, 2) middles of the closed door leaves of a world, m."""
    env = gym.make(f"dynslam_env:{env_id}", doors=law, **parameters)
    env.reset(seed=seed)
    place = env.unwrapped
    assert isinstance(place, DoorWorldEnv)
    doors = place.layout.doors
    half = [0.5 * d.width * np.array([np.cos(d.closed), np.sin(d.closed)]) for d in doors]
    return np.array([d.hinge for d in doors]).reshape(-1, 2) + np.array(half).reshape(-1, 2)


def sightings(episode: Episode, doors: Array) -> list[str]:
    """In which states MIN_SIGHTINGS scans saw each of the doors with the middles (d, 2), m: UNSEEN,
    OPEN, CLOSED or BOTH."""
    truth = episode.known_truth("what was seen of doors")
    closed = np.zeros(len(doors), np.int64)
    for scan, pose in zip(episode.scans, truth.poses.tolist(), strict=True):
        echoes = transform_points(Pose2(*pose), scan.points)
        away = np.hypot(*(echoes[:, None] - doors).T)
        closed += (away < MAX_LEAF_DISTANCE).any(axis=1)
    opened = seen_through(episode, doors) >= MIN_SIGHTINGS
    names = np.array([UNSEEN, OPEN, CLOSED, BOTH])
    return names[opened + 2 * (closed >= MIN_SIGHTINGS)].tolist()
