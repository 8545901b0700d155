"""Gymnasium environments of places that change."""

from dynslam_env.env import DoorCorridorEnv
from dynslam_env.record import Driver, Recorder, record
from dynslam_env.registration import PATROLS, WORLDS
from dynslam_env.sensors.laser import Laser
from dynslam_env.sensors.odometry import Odometry
from dynslam_env.simulation.doors import Doors
from dynslam_env.simulation.laws import Coupled, Exponential, Periodic, Scripted, Static, Uniform
from dynslam_env.simulation.people import People
from dynslam_env.simulation.robot import Robot
from dynslam_env.simulation.task import Task
from dynslam_env.slam_wrapper import SlamWrapper
from dynslam_env.vector import DoorCorridorVectorEnv
from dynslam_env.worlds.corridor import Corridor
from dynslam_env.worlds.layout import Door, Layout
from dynslam_env.worlds.loop import Loop
from dynslam_env.worlds.office import Office

__all__ = [
    "PATROLS",
    "WORLDS",
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
