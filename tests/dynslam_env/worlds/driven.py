"""Scripted drives through worlds, in the environment."""

from __future__ import annotations

import gymnasium as gym

from agents.scripted_path import ScriptedPath
from dynslam_env import DoorWorldEnv


def drive(name, seed, **parameters):
    """Whether a drive along the path arrives, and in how many of its steps anything was touched."""
    env = gym.make(name, **parameters)
    env.reset(seed=seed)
    world = env.unwrapped
    assert isinstance(world, DoorWorldEnv)
    driver = ScriptedPath(world.layout.path, lambda: world.pose, world.robot)
    touched = 0
    while True:
        _, _, terminated, truncated, info = env.step(driver.predict()[0])
        touched += info["collision"]
        if terminated or truncated:
            return bool(terminated), touched
