"""Information gain: the viewpoint whose scan brings the most bits per second of driving."""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from dynslam_env.navigation.frontiers import frontiers
from dynslam_env.navigation.goal import Goal
from dynslam_env.navigation.information import expected_bits
from dynslam_env.navigation.planning_snapshot import PlanningSnapshot
from slam.geometry import Array
from slam.scan import Scan

VIEWPOINTS = 40  # drawn from all reachable cells
PATH_SPEED = 0.5  # m/s, assumed along a path
VIEW_OVERHEAD = 2.0  # s, for turning and accelerating, on any path to a viewpoint
SWITCH_RATIO = 1.25  # factor by which another viewpoint must be better than the goal
MIN_BITS = 5.0  # of a viewpoint; with less the robot stays


class PoseTerm(Protocol):
    """Information gain of a viewpoint about the pose, in addition to that about the map."""

    def follow(self, planning: PlanningSnapshot) -> None:
        """Record the robot's present pose."""
        ...

    def places(self) -> Array:
        """(k, 2) m, further candidates for viewpoints."""
        ...

    def bits(self, points: Array, lengths: Array) -> Array:
        """(n,) of viewpoints (n, 2), m, at the end of paths of `lengths` (n,), m."""
        ...


class NoPoseTerm:
    """No information gain about the pose."""

    def follow(self, planning: PlanningSnapshot) -> None:
        """See `PoseTerm`."""

    def places(self) -> Array:
        """See `PoseTerm`."""
        return np.empty((0, 2))

    def bits(self, points: Array, lengths: Array) -> Array:
        """See `PoseTerm`."""
        return np.zeros(len(points))


class InformationChooser:
    """Chooses, of sampled viewpoints, the one with the most expected bits per second of driving.

    A next-best view (Gonzalez-Banos and Latombe 2002) with the expected information of a scan as
    its gain. The entropy of changing cells grows while they are not seen, so that it returns to the
    doors seen longest ago.

    rng   draws the viewpoints
    scan  a scan of the laser, for its field of view and range
    pose  information gain about the pose
    """

    def __init__(self, rng: np.random.Generator, scan: Scan, pose: PoseTerm | None = None):
        field_of_view = min(float(scan.angles[-1] - scan.angles[0]), math.tau)
        self._laser = field_of_view, scan.max_range
        self._rng, self._pose = rng, pose or NoPoseTerm()
        self._last: tuple[float, float] | None = None

    def goal(self, planning: PlanningSnapshot) -> Goal | None:
        """See `GoalChooser`."""
        self._pose.follow(planning)
        cells, kept = self._candidates(planning)
        if not len(cells):
            return None
        points = planning.costmap.spec.centres(cells)
        lengths = planning.plan.length[tuple(cells.T)]
        bits, headings = expected_bits(planning.beliefs, points, *self._laser)
        bits += self._pose.bits(points, lengths)
        value = bits / (lengths / PATH_SPEED + VIEW_OVERHEAD)
        if kept:
            value[0] *= SWITCH_RATIO
        best = int(np.argmax(value))
        if bits[best] < MIN_BITS:
            return None
        x, y = points[best].tolist()
        self._last = (x, y)
        row, col = cells[best].tolist()
        return Goal((row, col), float(headings[best]), self._last)

    def ended(self, goal: Goal, reached: bool, time: float) -> None:
        """See `GoalChooser`."""
        self._last = None

    def _candidates(self, planning: PlanningSnapshot) -> tuple[NDArray[np.int64], bool]:
        """(n, 2) reachable cells, and whether the first is the present goal."""
        reached = np.argwhere(planning.plan.reached & ~planning.costmap.swept)
        if not len(reached):
            return reached, False
        drawn = reached[self._rng.integers(len(reached), size=VIEWPOINTS)]
        found = frontiers(planning.costmap, planning.plan, planning.position)
        gates = [frontier.cell for frontier in found if frontier.cell is not None]
        spec, places = planning.costmap.spec, self._pose.places()
        if self._last is not None:
            places = np.concatenate([[self._last], places])
        wanted = spec.cells(places)
        fits: NDArray[np.bool_] = np.all((wanted >= 0) & (wanted < spec.shape), axis=1)
        fits[fits] = planning.plan.reached[tuple(wanted[fits].T)]
        kept = self._last is not None and bool(fits[0])
        return np.concatenate([wanted[fits], np.array(gates, int).reshape(-1, 2), drawn]), kept
