"""Drives with and without faults, step by step."""

from __future__ import annotations

from typing import NamedTuple

import gymnasium as gym
import numpy as np

from dynslam_env import DoorWorldEnv
from slam import Pose2
from slam.geometry import Array

STEPS = 80


class Drive(NamedTuple):
    """Rows of the reset and of each step: 0 is the reset.

    observed  (n, beams) float32, the scans of the observation
    told      (n, 3) float32, the odometry of the observation
    """

    poses: Array
    moved: Array
    ranges: Array
    observed: np.ndarray
    told: np.ndarray
    arrived: np.ndarray
    infos: list[dict]


def drive(faults=None, seed=3, steps=STEPS, name="DoorCorridor-v0", action=(0.5, 0.002), **parts):
    """A drive with one action throughout."""
    env = gym.make(name, faults=faults, **parts).unwrapped
    assert isinstance(env, DoorWorldEnv)
    observation, info = env.reset(seed=seed)
    rows = [_row(env, observation, info)]
    for _ in range(steps):
        observation, _, _, _, info = env.step(np.array(action, dtype=np.float32))
        assert observation in env.observation_space
        rows.append(_row(env, observation, info))
    poses, moved, ranges, observed, told, arrived = (
        np.array([r[k] for r in rows]) for k in range(6)
    )
    return Drive(poses, moved, ranges, observed, told, arrived, [row[6] for row in rows])


def _row(env, observation, info):
    scan, moved = env.scan.ranges, np.array(env.displacement)
    here = np.array(env.pose), moved, scan, observation["scan"], observation["odometry"]
    return *here, env.scan_arrived, info


def total(moved):
    """The composition of displacements (n, 3)."""
    pose = Pose2()
    for row in moved:
        pose = pose @ Pose2.of(row)
    return pose


def onset(made, name):
    """Number of the first step in which the fault `name` is active."""
    return next(k for k, info in enumerate(made.infos) if info["faults"][name])
