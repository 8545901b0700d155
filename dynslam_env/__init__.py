"""Gymnasium environments of places that change."""

import gymnasium

from dynslam_env.doors import Doors
from dynslam_env.env import DoorCorridorEnv
from dynslam_env.laser import Laser
from dynslam_env.layout import Corridor, Door, Layout
from dynslam_env.odometry import Odometry
from dynslam_env.record import Driver, Recorder, record
from dynslam_env.robot import Robot
from dynslam_env.slam_wrapper import SlamWrapper
from dynslam_env.task import Task

__all__ = [
    "Corridor",
    "Door",
    "DoorCorridorEnv",
    "Doors",
    "Driver",
    "Laser",
    "Layout",
    "Odometry",
    "Recorder",
    "Robot",
    "SlamWrapper",
    "Task",
    "record",
]

gymnasium.register(
    id="DoorCorridor-v0",
    entry_point="dynslam_env.env:DoorCorridorEnv",
    max_episode_steps=1000,
)
