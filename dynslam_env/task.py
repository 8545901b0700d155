"""What the robot is for: named reward terms, and named ends of an episode."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

from dynslam_env.checked import one_of, positive
from dynslam_env.layout import Layout
from slam.errors import InputError
from slam.geometry import Array, Pose2


class Event(NamedTuple):
    """What a step of the world amounts to: all that rewards and ends may look at.

    pose      the robot, truth
    collided  it touched a wall or a door during the step
    duration  s
    """

    pose: Pose2
    collided: bool
    duration: float


class Path:
    """How far along the layout's path the robot has come."""

    def __init__(self, waypoints: Array, reach: float):
        self._waypoints = [tuple(row) for row in waypoints.tolist()]
        self._reach, self._next = reach, 0
        legs = zip(self._waypoints, self._waypoints[1:], strict=False)
        self._beyond = [math.dist(a, b) for a, b in legs]  # m, of the legs between waypoints
        self.advanced = 0.0  # m, in the last step
        self._remaining: float | None = None

    def update(self, pose: Pose2) -> None:
        """Take in where the robot is."""
        to_next = self._distance(pose)
        while to_next < self._reach and self._next < len(self._waypoints) - 1:
            self._next += 1
            to_next = self._distance(pose)
        remaining = to_next + sum(self._beyond[self._next :])
        self.advanced = (remaining if self._remaining is None else self._remaining) - remaining
        self._remaining = remaining

    @property
    def arrived(self) -> bool:
        """The robot is at the last waypoint, and was at all others before."""
        return self._next == len(self._waypoints) - 1 and (self._remaining or 0.0) < self._reach

    def _distance(self, pose: Pose2) -> float:
        return math.dist((pose.x, pose.y), self._waypoints[self._next])


Term = Callable[[Event, Path], float]

TERMS: Mapping[str, Term] = {
    "progress": lambda event, path: path.advanced,
    "collision": lambda event, path: float(event.collided),
    "time": lambda event, path: event.duration,
    "arrived": lambda event, path: float(path.arrived),
}
ENDS: Mapping[str, Callable[[Event, Path], bool]] = {
    "arrived": lambda event, path: path.arrived,
    "crashed": lambda event, path: event.collided,
}


class Judge(Protocol):
    """One episode's rewards and end."""

    def __call__(self, event: Event) -> tuple[float, dict[str, float], dict[str, bool]]:
        """The reward, its weighted terms, and the ends: the episode is over if any is true."""
        ...


@dataclass(frozen=True)
class Task:
    """Drive along the layout's path, there and back.

    reward  name -> weight, of TERMS: `progress` in m along the path, `collision` 1 while touching,
            `time` in s, `arrived` 1 in the last step
    ends    names of ENDS: `arrived`, `crashed`
    reach   m, so near a waypoint counts as there
    """

    reward: Mapping[str, float] = field(
        default_factory=lambda: {"progress": 1.0, "collision": -0.1, "time": -0.05, "arrived": 5.0}
    )
    ends: tuple[str, ...] = ("arrived",)
    reach: float = 0.3

    def __post_init__(self) -> None:
        positive(self, "reach")
        for name, weight in self.reward.items():
            one_of("a name in Task.reward", name, tuple(TERMS))
            if not (isinstance(weight, int | float) and math.isfinite(weight)):
                raise InputError(f"Task.reward[{name!r}] must be a finite number, got {weight!r}")
        for name in self.ends:
            one_of("a name in Task.ends", name, tuple(ENDS))

    def judge(self, layout: Layout, start: Pose2) -> Judge:
        """A judge for one episode that begins at `start`."""
        path = Path(layout.path, self.reach)
        path.update(start)

        def judged(event: Event) -> tuple[float, dict[str, float], dict[str, bool]]:
            path.update(event.pose)
            terms = {name: w * TERMS[name](event, path) for name, w in self.reward.items()}
            ends = {name: ENDS[name](event, path) for name in self.ends}
            return sum(terms.values()), terms, ends

        return judged
