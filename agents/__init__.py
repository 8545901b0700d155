"""What drives the robot; every agent has stable-baselines3's `predict`."""

from agents.random_agent import RandomAgent
from agents.scripted_path import ScriptedPath, record_corridor, record_path

__all__ = ["RandomAgent", "ScriptedPath", "record_corridor", "record_path"]
