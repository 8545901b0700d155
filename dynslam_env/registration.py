"""Environment ids: importing this module registers them with Gymnasium."""

from __future__ import annotations

from typing import Any

import gymnasium

WORLDS: dict[str, tuple[int, dict[str, Any]]] = {
    "DoorCorridor-v0": (1000, {}),
    "DoorCorridorStatic-v0": (1000, {"doors": "static"}),
    "DoorLoop-v0": (2000, {"world": "loop"}),
    "DoorOffice-v0": (5000, {"world": "office"}),
    "DoorCrowd-v0": (1500, {"world": "crowd"}),
}
"""Ids of the environments of one robot without a SLAM: id -> (time limit in steps, keywords)."""

PATROLS = ("DoorPatrol-v0", "DoorPatrolGoals-v0")
"""Ids of the environments that are tasks for agents."""

for _name, (_limit, _keywords) in WORLDS.items():
    gymnasium.register(
        id=_name,
        entry_point="dynslam_env.env:DoorWorldEnv",
        vector_entry_point="dynslam_env.vector:DoorWorldVectorEnv",
        max_episode_steps=_limit,
        kwargs=_keywords,
    )

gymnasium.register(
    id=PATROLS[0],
    entry_point="dynslam_env.patrol.env:DoorPatrolEnv",
    vector_entry_point="dynslam_env.patrol.vector:DoorPatrolVectorEnv",
    max_episode_steps=250,
)
gymnasium.register(id=PATROLS[1], entry_point="dynslam_env.patrol.goals:DoorPatrolGoalsEnv")
