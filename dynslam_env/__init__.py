"""Gymnasium environments of worlds that change, for SLAM and navigation."""

from dynslam_env.calendar.campaign import Campaign, OnDate, Visit
from dynslam_env.calendar.door_calendar import DoorCalendar, InPairs, Recorded
from dynslam_env.calendar.habits import Dwell, Empirical, Habits, Weibull
from dynslam_env.env import DoorWorldEnv
from dynslam_env.faults.carried import CarriedAway
from dynslam_env.faults.fault import Fault, FaultState
from dynslam_env.faults.scans import Gap, Lag, MissingBeams, WrongBeams
from dynslam_env.faults.wheels import OdometryScale, Slip
from dynslam_env.record import Driver, Recorder, record
from dynslam_env.registration import PATROLS, WORLDS
from dynslam_env.sensors.effects import (
    EchoLoss,
    Effect,
    Latency,
    MixedPixels,
    Quantisation,
    RangeNoise,
    Surfaces,
    Sweep,
)
from dynslam_env.sensors.encoders import WheelEncoders
from dynslam_env.sensors.laser import Laser
from dynslam_env.sensors.laser_presets import LASERS
from dynslam_env.sensors.odometry import Odometry
from dynslam_env.simulation.doors import Doors
from dynslam_env.simulation.laws import (
    Clock,
    Coupled,
    Exponential,
    Fixed,
    FlipClock,
    Law,
    Periodic,
    Scripted,
    Uniform,
)
from dynslam_env.simulation.people import People
from dynslam_env.simulation.registry import register_law, register_world
from dynslam_env.simulation.robot import Robot
from dynslam_env.simulation.robot_presets import ROBOTS
from dynslam_env.simulation.task import Task
from dynslam_env.slam_vector import SlamVectorEnv
from dynslam_env.slam_wrapper import FinalScores, SlamWrapper
from dynslam_env.vector import DoorWorldVectorEnv
from dynslam_env.worlds.corridor import Corridor
from dynslam_env.worlds.from_map import FromMap
from dynslam_env.worlds.layout import Door, Generator, Layout
from dynslam_env.worlds.loop import Loop
from dynslam_env.worlds.office import Office
from dynslam_env.worlds.varied import Varied
from dynslam_env.worlds.wings import Wings

__all__ = [
    "LASERS",
    "PATROLS",
    "ROBOTS",
    "WORLDS",
    "Campaign",
    "CarriedAway",
    "Clock",
    "Corridor",
    "Coupled",
    "Door",
    "DoorCalendar",
    "DoorWorldEnv",
    "DoorWorldVectorEnv",
    "Doors",
    "Driver",
    "Dwell",
    "EchoLoss",
    "Effect",
    "Empirical",
    "Exponential",
    "Fault",
    "FaultState",
    "FinalScores",
    "Fixed",
    "FlipClock",
    "FromMap",
    "Gap",
    "Generator",
    "Habits",
    "InPairs",
    "Lag",
    "Laser",
    "Latency",
    "Law",
    "Layout",
    "Loop",
    "MissingBeams",
    "MixedPixels",
    "Odometry",
    "OdometryScale",
    "Office",
    "OnDate",
    "People",
    "Periodic",
    "Quantisation",
    "RangeNoise",
    "Recorded",
    "Recorder",
    "Robot",
    "Scripted",
    "SlamVectorEnv",
    "SlamWrapper",
    "Slip",
    "Surfaces",
    "Sweep",
    "Task",
    "Uniform",
    "Varied",
    "Visit",
    "Weibull",
    "WheelEncoders",
    "Wings",
    "WrongBeams",
    "record",
    "register_law",
    "register_world",
]
