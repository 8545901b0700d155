"""What the robot is for: named reward terms, and named ends of an episode."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

from dynslam_env.layout import Layout
from slam.checked import number, one_of, positive
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
    """How far along the layout's path the robot has come, leg by leg.

    A leg ends where the robot comes within reach of its waypoint; its way is measured by the foot
    of the perpendicular from the robot. No step advances by more than what was driven: where the
    path turns, the way back counts from where the robot is.
    """

    def __init__(self, start: Pose2, waypoints: Array, reach: float):
        self._points = [(start.x, start.y), *map(tuple, waypoints.tolist())]
        self._reach, self._leg, self._at = reach, 0, start
        self.advanced = 0.0  # m, in the last step
        self.update(start)

    def update(self, pose: Pose2) -> None:
        """Take in where the robot is."""
        self.advanced = self._along(pose) - self._along(self._at)
        self._at = pose
        while self._there and self._leg < len(self._points) - 2:
            self._leg += 1

    @property
    def arrived(self) -> bool:
        """The robot is at the last waypoint, and was at all others before."""
        return self._there and self._leg == len(self._points) - 2

    @property
    def _there(self) -> bool:
        return math.dist(self._at[:2], self._points[self._leg + 1]) < self._reach

    def _along(self, pose: Pose2) -> float:
        """m, from the beginning of the present leg to the point of it that is nearest to `pose`."""
        (x1, y1), (x2, y2) = self._points[self._leg : self._leg + 2]
        length = math.dist((x1, y1), (x2, y2))
        if length == 0.0:
            return 0.0
        along = ((pose.x - x1) * (x2 - x1) + (pose.y - y1) * (y2 - y1)) / length
        return min(max(along, 0.0), length)


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
    reach   m, so near a waypoint counts as there, and the way on from there is the next leg's
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
            number(f"Task.reward[{name!r}]", weight)
        for name in self.ends:
            one_of("a name in Task.ends", name, tuple(ENDS))

    def judge(self, layout: Layout, start: Pose2) -> Judge:
        """A judge for one episode that begins at `start`."""
        path = Path(start, layout.path, self.reach)

        def judged(event: Event) -> tuple[float, dict[str, float], dict[str, bool]]:
            path.update(event.pose)
            terms = {name: w * TERMS[name](event, path) for name, w in self.reward.items()}
            ends = {name: ENDS[name](event, path) for name in self.ends}
            return sum(terms.values()), terms, ends

        return judged
