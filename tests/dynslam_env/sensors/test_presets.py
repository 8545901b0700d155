"""Lasers and robots by name."""

import math
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from dynslam_env import (
    LASERS,
    PATROLS,
    ROBOTS,
    DoorWorldEnv,
    DoorWorldVectorEnv,
    Laser,
    MixedPixels,
    Robot,
)
from dynslam_env.simulation.config import WorldConfig
from slam import InputError, Pose2


def test_the_names_are_those_of_the_real_ones():
    assert list(LASERS) == ["SICK-LMS200", "Hokuyo-UTM-30LX", "RPLIDAR-A2"]
    assert list(ROBOTS) == ["Pioneer-3DX", "TurtleBot3"]


@pytest.mark.parametrize(
    ("name", "degrees", "beams", "reach"),
    [("SICK-LMS200", 1.0, 181, 80.0), ("Hokuyo-UTM-30LX", 0.25, 1081, 30.0),
     ("RPLIDAR-A2", 0.45, 800, 12.0)],
)  # fmt: skip
def test_lasers_have_the_beams_of_their_data_sheets(name, degrees, beams, reach):
    laser = LASERS[name]
    assert np.degrees(np.diff(laser.angles)) == pytest.approx(degrees)
    assert (laser.beams, laser.max_range) == (beams, reach)
    env = gym.make("DoorCorridor-v0", laser=name)
    observation, _ = env.reset(seed=0)
    assert observation in env.observation_space
    for _ in range(20):
        observation, *_ = env.step(np.array([0.5, 0.3], dtype=np.float32))
        assert observation in env.observation_space
    assert observation["scan"].shape == (beams,)


def test_a_named_robot_carries_the_laser_at_its_place():
    config = WorldConfig.of({"robot": "Pioneer-3DX"})
    assert config.robot == Robot(radius=0.25)
    assert config.laser == Laser(mount=Pose2(0.018, 0.0, 0.0))
    config = WorldConfig.of({"robot": "TurtleBot3", "laser": "SICK-LMS200"})
    assert config.robot.max_speed == 0.22
    assert config.laser.mount == Pose2(-0.032, 0.0, 0.0)
    assert config.laser.effects == LASERS["SICK-LMS200"].effects
    mounted = Laser(mount=Pose2(0.1, 0.0, 0.0))
    assert WorldConfig.of({"robot": "TurtleBot3", "laser": mounted}).laser == mounted


def test_robots_and_lasers_that_are_objects_stay_as_they_are():
    laser, robot = Laser(effects=(MixedPixels(),)), Robot(radius=0.3)
    config = WorldConfig.of({"robot": robot, "laser": laser})
    assert (config.robot, config.laser) == (robot, laser)
    assert WorldConfig.of({}) == WorldConfig.of({"robot": None, "laser": None})
    assert WorldConfig.of({}).laser == Laser()


@pytest.mark.parametrize("env", [DoorWorldEnv, DoorWorldVectorEnv])
@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"laser": "SICK-LMS20"}, "laser must be one of .*did you mean 'SICK-LMS200'"),
        ({"robot": "Turtlebot"}, "robot must be one of .*did you mean 'TurtleBot3'"),
        ({"robot": 3}, "robot must be a Robot, or one of Pioneer-3DX, TurtleBot3, got 3"),
        ({"laser": 3}, "laser must be a Laser, or one of SICK-LMS200"),
    ],
)
def test_unknown_names_are_answered_with_the_nearest(env, given, message):
    with pytest.raises(InputError, match=message):
        env(**given)


@pytest.mark.parametrize("robot", ROBOTS)
def test_a_named_robot_drives_as_fast_as_it_can(robot):
    env: Any = gym.make("DoorCorridor-v0", robot=robot, doors="static").unwrapped
    env.reset(seed=0)
    for _ in range(50):
        env.step(np.array([1.0, 0.0], dtype=np.float32))
    speed = math.hypot(*env.physics.robot[3:5])
    assert speed == pytest.approx(env.robot.max_speed, rel=0.01)


def test_patrols_take_the_names_too():
    env = gym.make(PATROLS[0], laser="SICK-LMS200", robot="Pioneer-3DX")
    observation, _ = env.reset(seed=0)
    assert observation in env.observation_space
    assert (
        gym.make_vec("DoorLoop-v0", 2, laser="RPLIDAR-A2").reset(seed=0)[0]["scan"].shape[1] == 800
    )


def test_the_description_of_an_environment_holds_the_effects():
    effects = WorldConfig.of({"laser": "SICK-LMS200"}).plain()["laser"]["effects"]
    assert {"type": "MixedPixels", "width": 0.0044, "merging": 1.5, "rays": 5} in effects
