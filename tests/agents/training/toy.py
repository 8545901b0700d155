"""DoorToy-v0: a room with one door, and the robot begins looking away from it."""

import math

import gymnasium
import numpy as np

from dynslam_env import Door, Laser, Layout, Periodic
from dynslam_env.patrol.rewards import RewardWeights
from slam import Pose2

SECONDS = 12.0
STEPS = round(SECONDS / 0.4)

ROOM = Layout(
    walls=np.array(
        [(0, 0, 5, 0), (5, 0, 5, 4), (5, 4, 3, 4), (2, 4, 0, 4), (0, 4, 0, 0),
         (3, 4, 3, 6), (3, 6, 2, 6), (2, 6, 2, 4)],
        dtype=float,
    ),
    doors=(Door((2.05, 4.1), 0.0, 1, 0.9, 0.04),),
    start=Pose2(2.5, 1.5, -math.pi / 4),
    path=np.array([(2.5, 2.0)]),
)  # fmt: skip

gymnasium.register(
    id="DoorToy-v0",
    entry_point="dynslam_env.patrol.env:DoorPatrolEnv",
    vector_entry_point="dynslam_env.patrol.vector:DoorPatrolVectorEnv",
    max_episode_steps=STEPS,
    kwargs={
        "world": ROOM,
        "doors": Periodic(4.0),
        "slam": "odometry",
        "laser": Laser(beams=61),
        "reward": RewardWeights({"freshness": 0.01}),
    },
)
