"""Environment ids: importing this module registers them with Gymnasium."""

from __future__ import annotations

import importlib
import warnings
from typing import Any

import gymnasium
from gymnasium.envs.registration import EnvSpec

from slam.errors import InputError

WORLD_ENTRY_POINT = "dynslam_env.env:DoorWorldEnv"

WORLDS: dict[str, tuple[int, dict[str, Any]]] = {
    "DoorCorridor-v0": (1000, {}),
    "DoorCorridorStatic-v0": (1000, {"doors": "static"}),
    "DoorLoop-v0": (2000, {"world": "loop"}),
    "DoorOffice-v0": (5000, {"world": "office"}),
    "DoorCrowd-v0": (1500, {"world": "crowd"}),
    "DoorWings-v0": (2500, {"world": "wings"}),
}
"""Ids of the environments of one robot without a SLAM: id -> (time limit in steps, keywords)."""

REWARD_THRESHOLDS = {
    "DoorCorridor-v0": 22.9,
    "DoorCorridorStatic-v0": 22.9,
    "DoorLoop-v0": 39.9,
    "DoorOffice-v0": 55.9,
    "DoorCrowd-v0": 21.4,
    "DoorWings-v0": 62.2,
    "DoorPatrol-v0": 61.7,
    "DoorPatrolGoals-v0": 40.4,
    "DoorPatrol-v1": 260.9,
}
"""Return from which an environment counts as solved: the lower end of the 95 % interval of the
median over test episodes, of worlds for the path driven by the true pose, of patrols the highest
for an agent that neither learned nor knows the truth (docs/splits.md)."""

PATROLS = ("DoorPatrol-v0", "DoorPatrolGoals-v0", "DoorPatrol-v1")
"""Ids of the environments that are tasks for agents."""


def imported_id(env: str) -> str:
    """The id in `ID` or `MODULE:ID`; imports the module, which registers it.

    Raises InputError for a module that cannot be imported.
    """
    module, _, name = env.rpartition(":")
    if module:
        try:
            importlib.import_module(module)
        except Exception as error:  # whatever the user's module raises
            raise InputError(
                f"the module of {env} cannot be imported ({type(error).__name__}: {error}): it "
                f"must be installed, or in a folder of PYTHONPATH"
            ) from None
    return name


def spec_of(env: str) -> EnvSpec:
    """What is registered as `ID` or `MODULE:ID`; raises InputError for nothing."""
    try:
        return gymnasium.spec(imported_id(env))
    except gymnasium.error.Error as error:
        raise InputError(str(error)) from None


def world_ids() -> tuple[str, ...]:
    """Ids of the environments of one robot without a SLAM, those of other packages among them."""
    specs = gymnasium.registry.items()
    return tuple(name for name, spec in specs if spec.entry_point == WORLD_ENTRY_POINT)


for _name, (_limit, _keywords) in WORLDS.items():
    gymnasium.register(
        id=_name,
        entry_point=WORLD_ENTRY_POINT,
        vector_entry_point="dynslam_env.vector:DoorWorldVectorEnv",
        max_episode_steps=_limit,
        reward_threshold=REWARD_THRESHOLDS[_name],
        kwargs=_keywords,
    )

gymnasium.register(
    id=PATROLS[0],
    entry_point="dynslam_env.patrol.env:DoorPatrolEnv",
    vector_entry_point="dynslam_env.patrol.vector:DoorPatrolVectorEnv",
    max_episode_steps=250,
    reward_threshold=REWARD_THRESHOLDS[PATROLS[0]],
)
gymnasium.register(
    id=PATROLS[1],
    entry_point="dynslam_env.patrol.goals:DoorPatrolGoalsEnv",
    vector_entry_point="dynslam_env.patrol.goals_vector:DoorPatrolGoalsVectorEnv",
    reward_threshold=REWARD_THRESHOLDS[PATROLS[1]],
)
gymnasium.register(
    id=PATROLS[2],
    entry_point="dynslam_env.patrol.long_env:LongPatrolEnv",
    max_episode_steps=1500,
    reward_threshold=REWARD_THRESHOLDS[PATROLS[2]],
)

# DoorPatrol-v1 is another task, with slower doors; Gymnasium would say that it replaces v0
warnings.filterwarnings("ignore", message=".*DoorPatrol-v0 is out of date")
