"""Agents that drive the robot; each has stable-baselines3's `predict`."""

from agents.goal_choosers.goal_agent import GoalAgent, GoalChooser
from agents.random_agent import RandomAgent
from agents.registry import AgentBuilder, builder_of, check, make, names, register
from agents.scripted_path import ScriptedPath, record_corridor, record_path
from dynslam_env.navigation.goal import Goal
from dynslam_env.navigation.patrol_snapshot import PatrolSnapshot, PatrolView
from dynslam_env.navigation.planning_snapshot import PlanningSnapshot

__all__ = [
    "AgentBuilder",
    "Goal",
    "GoalAgent",
    "GoalChooser",
    "PatrolSnapshot",
    "PatrolView",
    "PlanningSnapshot",
    "RandomAgent",
    "ScriptedPath",
    "builder_of",
    "check",
    "make",
    "names",
    "record_corridor",
    "record_path",
    "register",
]
