"""Task: the reward terms and the ends of an episode; TaskProgress computes them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dynslam_env.worlds.layout import Layout
from slam.errors import InputError
from slam.geometry import Array
from slam.kernel import kernel
from slam.validation import instance, number, one_of, positive

Rows = NDArray[np.int64]
TERMS = ("progress", "collision", "time", "arrived")
ENDS = ("arrived", "crashed")


@dataclass(frozen=True)
class Task:
    """Drive along the layout's path.

    reward  weights of the terms: `progress` in m along the path, `collision` 1 in a step with
            contact, `time` in s, `arrived` 1 in the last step. A term without a weight is left out
    ends    some of `arrived`, `crashed`
    reach   m, distance to a waypoint at which it counts as reached and the next leg begins
    """

    reward: Mapping[str, float] = field(
        hash=False,
        default_factory=lambda: {"progress": 1.0, "collision": -0.1, "time": -0.05, "arrived": 5.0},
    )
    ends: tuple[str, ...] = ("arrived",)
    reach: float = 0.3

    def __post_init__(self) -> None:
        positive(self, "reach")
        instance("Task.reward", self.reward, Mapping)
        if isinstance(self.ends, str):
            raise InputError(f"Task.ends must be a tuple of names, got {self.ends!r}")
        object.__setattr__(self, "reward", dict(self.reward))  # a private copy
        object.__setattr__(self, "ends", tuple(self.ends))
        for name, weight in self.reward.items():
            one_of("a name in Task.reward", name, TERMS)
            number(f"Task.reward[{name!r}]", weight)
        for name in self.ends:
            one_of("a name in Task.ends", name, ENDS)


class TaskTerms(NamedTuple):
    """The reward terms and ends of a `Task`, by their numbers in TERMS and ENDS.

    kinds    (t,) reward terms
    weights  (t,)
    ends     (e,) ends of an episode
    """

    kinds: Rows
    weights: Array
    ends: Rows


class PathPositions(NamedTuple):
    """How far along their paths n robots are.

    paths    (n, k, 2) m, waypoints
    legs     (n, 2) the current leg and the last one
    at       (n, 2) m, the positions after the last step
    arrived  (n,) bool, whether the path was completed in this step or an earlier one
    """

    paths: Array
    legs: Rows
    at: Array
    arrived: NDArray[np.bool_]


class StepResults(NamedTuple):
    """Terms, rewards and ends of a step of n robots: see `TaskProgress`."""

    terms: Array
    rewards: Array
    ends: NDArray[np.bool_]


class TaskProgress:
    """Progress of n robots along the paths of their layouts, their rewards, and the ends reached.

    A leg ends when the robot is within reach of its waypoint. The progress along a leg is measured
    by the foot of the perpendicular from the robot. When the next leg begins, its progress starts
    at the robot's own foot on it: a step never gains more than the distance driven. The term
    `arrived` is paid once; the end of that name stays true if the robot drives on.

    terms    (n, t) weighted terms, in the order of `Task.reward`
    rewards  (n,) sums of the terms
    ends     (n, e) bool, in the order of `Task.ends`
    """

    def __init__(self, task: Task, n: int):
        kinds = np.array([TERMS.index(name) for name in task.reward], dtype=np.int64)
        weights = np.array(list(task.reward.values()), dtype=np.float64)
        ends = np.array([ENDS.index(name) for name in task.ends], dtype=np.int64)
        self.reach, self.task_terms = task.reach, TaskTerms(kinds, weights, ends)
        self._paths, self._legs = np.zeros((n, 2, 2)), np.zeros((n, 2), dtype=np.int64)
        self._at, self._arrived = np.zeros((n, 2)), np.zeros(n, dtype=np.bool_)
        self.terms, self.rewards = np.zeros((n, len(kinds))), np.zeros(n)
        self.ends = np.zeros((n, len(ends)), dtype=np.bool_)

    def reset(self, i: int, layout: Layout, pose: Array) -> None:
        """Start an episode of robot `i` at `pose` (3,)."""
        points = np.vstack([pose[:2], layout.path])
        longer = len(points) - self._paths.shape[1]
        if longer > 0:
            self._paths = np.pad(self._paths, ((0, 0), (0, longer), (0, 0)))
        self._paths[i, : len(points)] = points
        self._legs[i] = 0, len(points) - 2
        self._at[i], self._arrived[i] = pose[:2], False
        _pass(i, self._paths, self._legs, self._at, self.reach)

    def carried(self, i: int, pose: Array) -> None:
        """Robot `i` was put down at `pose` (3,): that gains nothing, and no leg ends by it."""
        self._at[i] = pose[:2]

    def update(self, which: Rows, poses: Array, collided: NDArray[np.bool_], dt: float) -> None:
        """Compute terms, rewards and ends after a step of `dt` s of robots `which` to `poses`."""
        results = StepResults(self.terms, self.rewards, self.ends)
        judge(which, poses, collided, dt, self.reach, self.positions, self.task_terms, results)

    @property
    def positions(self) -> PathPositions:
        """How far along their paths the robots are."""
        return PathPositions(self._paths, self._legs, self._at, self._arrived)


@kernel
def _along(x, y, paths, i, leg):
    """Distance in m from the start of a leg to its point nearest to (x, y)."""
    x1, y1 = paths[i, leg, 0], paths[i, leg, 1]
    x2, y2 = paths[i, leg + 1, 0], paths[i, leg + 1, 1]
    length = math.hypot(x2 - x1, y2 - y1)
    if length == 0.0:
        return 0.0
    along = ((x - x1) * (x2 - x1) + (y - y1) * (y2 - y1)) / length
    return min(max(along, 0.0), length)


@kernel
def _pass(i, paths, legs, at, reach):
    """Advance past all waypoints within reach; whether the last one is reached."""
    while True:
        leg, last = legs[i, 0], legs[i, 1]
        there = math.hypot(paths[i, leg + 1, 0] - at[i, 0], paths[i, leg + 1, 1] - at[i, 1]) < reach
        if not there or leg == last:
            return there
        legs[i, 0] = leg + 1


@kernel
def judge(
    which, poses, collided, dt, reach, positions: PathPositions, task: TaskTerms,
    results: StepResults,
):  # fmt: skip
    """Advance the robots `which`, and write the results of a step of `dt` s."""
    paths, legs, at, arrived = positions
    kinds, weights, ends = task
    terms, rewards, over = results
    for i in which:
        x, y, leg = poses[i, 0], poses[i, 1], legs[i, 0]
        advanced = _along(x, y, paths, i, leg) - _along(at[i, 0], at[i, 1], paths, i, leg)
        at[i, 0], at[i, 1] = x, y
        first = _pass(i, paths, legs, at, reach) and not arrived[i]
        arrived[i] |= first
        hit = 1.0 if collided[i] else 0.0
        values = (advanced, hit, dt, 1.0 if first else 0.0)  # as TERMS
        rewards[i] = 0.0
        for k in range(len(kinds)):
            terms[i, k] = weights[k] * values[kinds[k]]
            rewards[i] += terms[i, k]
        for k in range(len(ends)):
            over[i, k] = (arrived[i], collided[i])[ends[k]]  # as ENDS
