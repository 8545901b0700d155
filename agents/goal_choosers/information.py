"""Where a scan brings the most bits for the time it takes to get there."""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from agents.goal_choosers.pose_information import PoseInformation
from dynslam_env.navigation.frontiers import frontiers
from dynslam_env.navigation.goal import Goal
from dynslam_env.navigation.information import expected_bits
from dynslam_env.navigation.site import PatrolView
from dynslam_env.navigation.survey import PlanningSnapshot
from slam.geometry import Array

SAMPLES = 40  # viewpoints drawn from all that can be reached
SPEED = 0.5  # m/s, that a way takes
TURN_TIME = 2.0  # s, for turning and speeding up, on any way
KEEP = 1.25  # times: so much better another goal must be than the one it is driving to
LEAST = 5.0  # bits: for less nothing is worth a way


class PoseTerm(Protocol):
    """What a viewpoint brings besides what its scan shows of the map."""

    def follow(self, survey: PlanningSnapshot) -> None:
        """Take notice of where the robot is."""
        ...

    def places(self) -> Array:
        """(k, 2) m, viewpoints that it wants to be considered."""
        ...

    def bits(self, points: Array, lengths: Array) -> Array:
        """(n,) of viewpoints (n, 2), m, at the end of ways of `lengths` (n,), m."""
        ...


class NoPoseTerm:
    """The map alone."""

    def follow(self, survey: PlanningSnapshot) -> None:
        """See `PoseTerm`."""

    def places(self) -> Array:
        """See `PoseTerm`."""
        return np.empty((0, 2))

    def bits(self, points: Array, lengths: Array) -> Array:
        """See `PoseTerm`."""
        return np.zeros(len(points))


class InformationChooser:
    """Of sampled viewpoints, the one with the most expected bits a second of way.

    A next-best view (Gonzalez-Banos and Latombe 2002) with the expected information of a scan as
    its gain. Cells that change lose what was known of them while nobody looks, so that the doors
    seen longest ago draw it back without being named.

    rng    draws the viewpoints
    laser  field of view, rad, and range, m, of the scans that are foreseen
    pose   what a viewpoint brings for the pose
    """

    def __init__(
        self,
        rng: np.random.Generator,
        laser: tuple[float, float] = (math.pi, 8.0),
        pose: PoseTerm | None = None,
    ):
        self._rng, self._laser, self._pose = rng, laser, pose or NoPoseTerm()
        self._last: tuple[float, float] | None = None

    def goal(self, survey: PlanningSnapshot) -> Goal | None:
        """See `GoalChooser`."""
        self._pose.follow(survey)
        cells, kept = self._candidates(survey)
        if not len(cells):
            return None
        points = survey.costmap.spec.centres(cells)
        lengths = survey.plan.length[tuple(cells.T)]
        bits, headings = expected_bits(survey.beliefs, points, *self._laser)
        bits += self._pose.bits(points, lengths)
        value = bits / (lengths / SPEED + TURN_TIME)
        if kept:
            value[0] *= KEEP
        best = int(np.argmax(value))
        if bits[best] < LEAST:
            return None
        x, y = points[best].tolist()
        self._last = (x, y)
        row, col = cells[best].tolist()
        return Goal((row, col), float(headings[best]), self._last)

    def ended(self, goal: Goal, reached: bool, time: float) -> None:
        """See `GoalChooser`."""
        self._last = None

    def _candidates(self, survey: PlanningSnapshot) -> tuple[NDArray[np.int64], bool]:
        """(n, 2) cells that can be reached, and whether the first is the last goal."""
        reached = np.argwhere(survey.plan.reached & ~survey.costmap.swept)
        if not len(reached):
            return reached, False
        drawn = reached[self._rng.integers(len(reached), size=SAMPLES)]
        found = frontiers(survey.costmap, survey.plan, survey.position)
        gates = [frontier.cell for frontier in found if frontier.cell is not None]
        spec, places = survey.costmap.spec, self._pose.places()
        if self._last is not None:
            places = np.concatenate([[self._last], places])
        wanted = spec.cells(places)
        fits: NDArray[np.bool_] = np.all((wanted >= 0) & (wanted < spec.shape), axis=1)
        fits[fits] = survey.plan.reached[tuple(wanted[fits].T)]
        kept = self._last is not None and bool(fits[0])
        return np.concatenate([wanted[fits], np.array(gates, int).reshape(-1, 2), drawn]), kept


def laser_of(site: PatrolView) -> tuple[float, float]:
    """Field of view, rad, and range, m, of a site's scans."""
    angles = site.scan.angles
    return min(float(angles[-1] - angles[0]), math.tau), site.scan.max_range


def with_pose(site: PatrolView, rng: np.random.Generator) -> InformationChooser:
    """The map's bits and the pose's."""
    return InformationChooser(rng, laser_of(site), PoseInformation(site))
