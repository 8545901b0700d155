"""Gymnasium environments of places that change."""

from typing import Any

import gymnasium

from dynslam_env.doors import Doors
from dynslam_env.env import DoorCorridorEnv
from dynslam_env.laser import Laser
from dynslam_env.laws import Coupled, Exponential, Periodic, Scripted, Static, Uniform
from dynslam_env.layout import Door, Layout
from dynslam_env.odometry import Odometry
from dynslam_env.people import People
from dynslam_env.record import Driver, Recorder, record
from dynslam_env.robot import Robot
from dynslam_env.slam_wrapper import SlamWrapper
from dynslam_env.task import Task
from dynslam_env.vector import DoorCorridorVectorEnv
from dynslam_env.worlds.corridor import Corridor
from dynslam_env.worlds.loop import Loop
from dynslam_env.worlds.office import Office

__all__ = [
    "Corridor",
    "Coupled",
    "Door",
    "DoorCorridorEnv",
    "DoorCorridorVectorEnv",
    "Doors",
    "Driver",
    "Exponential",
    "Laser",
    "Layout",
    "Loop",
    "Odometry",
    "Office",
    "People",
    "Periodic",
    "Recorder",
    "Robot",
    "Scripted",
    "SlamWrapper",
    "Static",
    "Task",
    "Uniform",
    "record",
]

WORLDS: dict[str, tuple[int, dict[str, Any]]] = {
    "DoorCorridor-v0": (1000, {}),
    "DoorCorridorStatic-v0": (1000, {"doors": "static"}),
    "DoorLoop-v0": (2000, {"world": "loop"}),
    "DoorOffice-v0": (5000, {"world": "office"}),
    "DoorCrowd-v0": (1500, {"world": "crowd"}),
}
"""The environments' names, their time limits in steps, and their keywords."""

for _name, (_limit, _keywords) in WORLDS.items():
    gymnasium.register(
        id=_name,
        entry_point="dynslam_env.env:DoorCorridorEnv",
        vector_entry_point="dynslam_env.vector:DoorCorridorVectorEnv",
        max_episode_steps=_limit,
        kwargs=_keywords,
    )

PATROLS = ("DoorPatrol-v0", "DoorPatrolGoals-v0")
"""The names of the tasks for agents."""

gymnasium.register(
    id=PATROLS[0],
    entry_point="dynslam_env.patrol.env:DoorPatrolEnv",
    vector_entry_point="dynslam_env.patrol.vector:DoorPatrolVectorEnv",
    max_episode_steps=250,
)

gymnasium.register(id=PATROLS[1], entry_point="dynslam_env.patrol.goals:DoorPatrolGoalsEnv")
