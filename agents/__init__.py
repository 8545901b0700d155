"""What drives the robot; every agent has stable-baselines3's `predict`."""

from agents.random_agent import RandomAgent
from agents.registry import check, make, names
from agents.scripted_path import ScriptedPath, record_corridor, record_path

__all__ = [
    "RandomAgent",
    "ScriptedPath",
    "check",
    "make",
    "names",
    "record_corridor",
    "record_path",
]
