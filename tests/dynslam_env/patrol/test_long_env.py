"""DoorPatrol-v1: its defaults, questions and beliefs about doors."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import dynslam_env  # noqa: F401
from dynslam_env.navigation.door_belief import HORIZONS
from dynslam_env.patrol.belief_map import BeliefMap
from dynslam_env.patrol.env import DoorPatrolEnv
from dynslam_env.patrol.slow_doors import SlowDoors

TURN = np.array([0.0, 0.6], dtype=np.float32)


def turned(env: Any, steps: int) -> list[dict[str, Any]]:
    """The infos of turning on the spot."""
    return [env.step(TURN)[4] for _ in range(steps)]


def test_defaults() -> None:
    env: Any = gym.make("DoorPatrol-v1")
    assert env.spec.max_episode_steps == 1500
    env.reset(options={"split": "train", "index": 0})
    place = env.unwrapped.place
    assert isinstance(place.world_config.doors.law, SlowDoors)
    assert isinstance(env.unwrapped.patroller.memory, BeliefMap)


def test_questions_are_asked_every_ten_seconds_on_average() -> None:
    env: Any = gym.make("DoorPatrol-v1").unwrapped
    env.reset(options={"split": "train", "index": 1})
    asked = [lost for info in turned(env, 250) for lost in info["regrets"]]
    assert 3 <= len(asked) <= 20
    assert min(asked) >= -1e-9


def test_floors_of_train_and_test_differ() -> None:
    env: Any = gym.make("DoorPatrol-v1").unwrapped
    floors = []
    for split in ("train", "test", "train"):
        env.reset(options={"split": split, "index": 5})
        floors.append(env.place.layout.walls)
    assert np.array_equal(floors[0], floors[2])
    assert floors[0].shape != floors[1].shape or not np.array_equal(floors[0], floors[1])


def test_beliefs_about_doors_forecast_and_the_old_map_has_none() -> None:
    env: Any = gym.make("DoorPatrol-v1").unwrapped
    env.reset(options={"split": "train", "index": 0})
    turned(env, 25)
    beliefs = env.door_beliefs()
    assert beliefs
    for one in beliefs:
        assert one.stale.shape == one.fresh.shape == HORIZONS.shape
        assert one.stale[0] == pytest.approx(one.closed * (1.0 - one.closed))
        assert one.fresh[0] < 0.01
        assert (np.diff(one.fresh[:5]) >= -1e-9).all()
    old = DoorPatrolEnv(world="office")
    old.reset(seed=0)
    assert old.door_beliefs() == []
