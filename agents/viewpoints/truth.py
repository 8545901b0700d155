"""TrueBeliefs: the true doors, and how wrong the belief about each of them is. For oracles only."""

from __future__ import annotations

import math

import numpy as np

from agents.viewpoints.floors import doorways
from dynslam_env.navigation.door_belief import HORIZONS, DoorBelief
from dynslam_env.patrol.doors_known import CLOSED_ANGLE, DoorsKnown, closed
from dynslam_env.patrol.env import DoorPatrolEnv
from slam.geometry import Array

FADING = 120.0  # s, in which the present error becomes the expected one
SAME_DOOR = 0.5  # m, from a doorway that the robot suspects to the true one
UNKNOWN_ERROR = 0.25  # squared error of a door of which nothing is known


class TrueBeliefs:
    """Beliefs about the true doors, with the true error in the place of the expected one.

    env  the patrol, whose true doors are read at each call
    """

    def __init__(self, env: DoorPatrolEnv):
        self._env, layout = env, env.place.layout
        self._known = DoorsKnown(layout)
        self._places = doorways(layout)

    def __call__(self) -> list[DoorBelief]:
        """See `Beliefs` of `ViewpointChooser`."""
        env = self._env
        p = closed(self._known.near(env.patroller.memory, env.time))
        errors = (p - (env.place.physics.openings < CLOSED_ANGLE)) ** 2
        suspected = env.door_beliefs()
        return [self._belief(*row, suspected) for row in zip(self._places, p, errors, strict=True)]

    def _belief(
        self, place: Array, p: float, error: float, suspected: list[DoorBelief]
    ) -> DoorBelief:
        near = [one for one in suspected if math.dist(one.place[:2], place[:2]) < SAME_DOOR]
        unknown = np.full(len(HORIZONS), UNKNOWN_ERROR)
        stale, fresh = (near[0].stale, near[0].fresh) if near else (unknown, 0.0 * unknown)
        stale = stale + (error - stale[0]) * np.exp(-HORIZONS / FADING)
        age = near[0].age if near else math.inf
        return DoorBelief(place, p, age, True, stale, fresh)
