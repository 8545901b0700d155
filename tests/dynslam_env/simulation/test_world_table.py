"""One call of a kernel for all robots gives what the parts give one by one."""

import copy
from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from dynslam_env import Odometry
from dynslam_env.sensors.laser import fill_normal
from dynslam_env.simulation.bodies import MOST_COMMANDS
from dynslam_env.simulation.pointers import copy_doubles, doubles_of, pointers_to


@dataclass(frozen=True)
class OwnOdometry(Odometry):
    """The same, which the kernel does not know."""


def drive(odometry, steps=200):
    env: Any = gym.make_vec("DoorCorridor-v0", 3, max_episode_steps=90, odometry=odometry)
    observation, _ = env.reset(seed=5)
    rng, told = np.random.default_rng(0), [observation]
    for _ in range(steps):
        actions = rng.uniform((0.2, -0.3), (1.0, 0.3), (3, 2)).astype(np.float32)
        observation, rewards, ends, _, infos = env.step(actions)
        told.append(observation | {"reward": rewards, "ends": ends, "hit": infos["collision"]})
    return told


def test_at_once_and_one_by_one_is_the_same_to_the_bit():
    at_once, one_by_one = drive(Odometry()), drive(OwnOdometry())
    assert any(step["hit"].any() for step in at_once[1:])
    assert not all(step["hit"].any() for step in at_once[1:])
    for step, other in zip(at_once, one_by_one, strict=True):
        for key, rows in step.items():
            assert rows.tobytes() == other[key].tobytes(), key


def test_a_copy_has_the_commands_that_are_still_kept_and_those_that_are_not():
    env: Any = gym.make("DoorCorridor-v0").unwrapped
    env.reset(seed=0)
    for steps in (MOST_COMMANDS - 1, 1, 1):
        for _ in range(steps):
            env.step(env.action_space.sample())
        other = copy.deepcopy(env.physics)
        assert other.steps == env.physics.steps
        assert other.bodies.tobytes() == env.physics.bodies.tobytes()


def test_the_numbers_of_a_kernel_are_numpys():
    rng, own = np.random.default_rng(3), np.empty((40, 5000))
    fill_normal(rng, own)
    other = np.random.default_rng(3)
    assert own.tobytes() == other.standard_normal(own.shape).tobytes()
    assert rng.bit_generator.state == other.bit_generator.state


def test_pointers():
    with pytest.raises(ValueError, match="an array with gaps"):
        pointers_to([np.zeros((4, 4))[:, :2]])
    here, there = [np.arange(3.0), np.full((2, 2), 7.0)], [np.zeros(3), np.zeros((2, 2))]
    copy_doubles(doubles_of(here), doubles_of(there))
    assert there[0].tolist() == [0, 1, 2]
    assert (there[1] == 7.0).all()
