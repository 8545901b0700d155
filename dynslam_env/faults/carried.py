"""CarriedAway: the robot is lifted and put down elsewhere, and the wheels report nothing."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from dynslam_env.faults.fault import (
    ANY_TIME,
    FaultState,
    Setting,
    Surroundings,
    Time,
    check_times,
    drawn,
)
from dynslam_env.worlds.clearance import gap, inside
from slam.geometry import Array, Pose2
from slam.validation import one_of, positive

PLACES = ("visited", "new")
CLEARANCE = 0.05  # m, between the robot that is put down and everything solid
PATH_SPACING = 0.25  # m, between the places of the path at which it may be put down
MAX_TRIES = 200  # places that are tried in a step


@dataclass(frozen=True)
class CarriedAway:
    """The robot is carried to another place, where it stands still; the odometry reports nothing.

    It happens in the first step from `at` on in which there is such a place that touches no wall,
    leaf or person.

    to        "visited": a pose that the robot had before; "new": a place on the layout's path, in
              its direction, at least `distance` from all places where the robot has been
    distance  m, least distance from where it is lifted
    at        when
    """

    to: str = "visited"
    distance: float = 3.0
    at: Time = ANY_TIME

    def __post_init__(self) -> None:
        one_of("CarriedAway.to", self.to, PLACES)
        positive(self, "distance")
        check_times(self)

    def begin(self, rng: np.random.Generator, setting: Setting) -> FaultState:
        """See `Fault`."""
        return _CarriedState(self, rng)


class _CarriedState(FaultState):
    def __init__(self, fault: CarriedAway, rng: np.random.Generator):
        super().__init__(drawn(fault.at, rng), None)
        self._fault, self._rng = fault, rng
        self._visited: list[Pose2] = []

    def advance(self, time: float) -> None:
        self.active = False

    def carry(self, here: Surroundings, time: float) -> Pose2 | None:
        if not math.isnan(self.since):
            return None
        self._visited.append(here.pose)
        found = self._place(here) if time >= self._start else None
        if found is not None:
            self.active, self.since = True, time
        return found

    def _place(self, here: Surroundings) -> Pose2 | None:
        """One of the places, if there is any."""
        visited = np.array(self._visited)
        if self._fault.to == "visited":
            places = _far(visited, visited[-1:], self._fault.distance)
        else:
            places = _far(along(here.path), visited, self._fault.distance)
        for k in self._rng.permutation(len(places))[:MAX_TRIES].tolist():
            if is_free(places[k], here):
                return Pose2.of(places[k])
        return None


def along(path: Array) -> Array:
    """(n, 3) poses along a path (p, 2), m, in its direction."""
    legs = np.diff(path, axis=0)
    lengths = np.hypot(*legs.T)
    poses = [np.zeros((0, 3))]
    for start, leg, length in zip(path[:-1], legs, lengths, strict=True):
        shares = np.arange(0.0, 1.0, PATH_SPACING / max(length, PATH_SPACING))
        heading = np.full(len(shares), math.atan2(leg[1], leg[0]))
        poses.append(np.column_stack([start + shares[:, None] * leg, heading]))
    return np.concatenate(poses)


def is_free(place: Array, here: Surroundings) -> bool:
    """Whether the robot fits at `place` (3,) without touching anything solid."""
    x, y = float(place[0]), float(place[1])
    solids = here.segments[here.first_edge :]
    clear = gap(np.array([(x, y, x, y)]), here.segments) >= here.radius + CLEARANCE
    return clear and not inside(solids, x, y)


def _far(places: Array, others: Array, distance: float) -> Array:
    """Those of the places (n, 3) that are at least `distance` m from all `others` (m, 3)."""
    apart = places[:, None, :2] - others[None, :, :2]
    return places[np.hypot(apart[..., 0], apart[..., 1]).min(axis=1) >= distance]
