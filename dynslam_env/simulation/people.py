"""People who walk back and forth along routes, avoid each other, and wait at closed doors."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from dynslam_env.simulation.walking import Routes, WalkState, steer
from dynslam_env.worlds.clearance import first_crossed, legs
from dynslam_env.worlds.layout import LATCH_GAP, Door, Layout
from slam.errors import InputError
from slam.geometry import Array
from slam.kernel import kernel
from slam.validation import positive, within

PASSABLE_SHARE = 0.75  # of a door's opening angle, from which people walk through
LEAF_OVERLAP = 0.01  # m beyond its free edge, where a way still leads through a leaf
BRAKING_FORCE_SHARE = 0.7  # of the force, assumed available to stop at a waypoint


@dataclass(frozen=True)
class People:
    """How people walk. Their routes, one per person, are the layout's `routes`.

    radius       m, of the regular octagon that is a person to the laser and to the robot
    speed        m/s
    pause_min    s, of the pause at each end of a route, drawn from U(pause_min, pause_max)
    pause_max    s
    patience     s, after which a person who is blocked turns around
    mass         kg
    force        N, largest force with which a person pushes
    """

    radius: float = 0.2
    speed: float = 1.0
    pause_min: float = 2.0
    pause_max: float = 8.0
    patience: float = 3.0
    mass: float = 70.0
    force: float = 100.0

    def __post_init__(self) -> None:
        positive(self, "radius", "speed", "patience", "mass", "force")
        within(self, "pause_min", 0.0)
        within(self, "pause_max", 0.0)
        if self.pause_min > self.pause_max:
            raise InputError(
                f"People need pause_min <= pause_max, got {self.pause_min:g} > {self.pause_max:g} s"
            )


class Walkers:
    """The people of an episode, and their desired velocities.

    A person starts a leg of the route that leads through a door when that door is open and nobody
    else passes through it. A person who is blocked steps aside, to the right if the obstacle is
    straight ahead, and finally turns around. A standing person steps aside for a walking one.

    velocities (p, 2) m/s, desired
    """

    def __init__(self, people: People, layout: Layout, rng: np.random.Generator):
        count = len(layout.routes)
        longest = max((len(route) for route in layout.routes), default=2)
        self._people, self._rng = people, rng
        self._routes = np.zeros((count, longest, 2))
        self._gates = np.full((count, longest - 1), -1, dtype=np.int64)
        doors = layout.doors if count else ()
        leaves = _closed(doors, LEAF_OVERLAP)
        for i, route in enumerate(layout.routes):
            self._routes[i, : len(route)] = route
            self._gates[i, : len(route) - 1] = first_crossed(legs(route), leaves)
        self._other_leaf = other_leaves(_closed(doors, 0.0))
        lengths = [len(route) for route in layout.routes]
        self._lengths = np.array(lengths, dtype=np.int64)
        self._state = np.zeros(
            (count, 3), dtype=np.int64
        )  # from waypoint, to waypoint, whether walking
        self._state[:, 1] = 1
        self._clock = np.zeros((count, 2))  # end of the pause, s; time blocked, s
        self._ways = np.zeros(
            (count, 2)
        )  # unit vectors of the directions of walking; zero while standing
        self._clock[:, 0] = self._pauses()[:count, 0] if count else 0.0
        self.velocities = np.zeros((count, 2))

    def starts(self) -> Array:
        """(p, 2) m, initial positions: the starts of the routes.

        Where two would overlap, the second is placed beside the first.
        """
        places: list[Array] = []
        for i in range(len(self._routes)):
            place, ring = self._routes[i, 0], 0
            while any(math.dist(place, other) < 2.5 * self._people.radius for other in places):
                turned = math.tau * (ring % 6) / 6
                distance = 2.6 * self._people.radius * (1 + ring // 6)
                offset = distance * np.array([math.cos(turned), math.sin(turned)])
                place, ring = self._routes[i, 0] + offset, ring + 1
            places.append(place)
        return np.array(places).reshape(-1, 2)

    def steer(self, time: float, dt: float, bodies: Array, robot: Array, openings: Array) -> None:
        """Set the desired velocities for the next `dt` s.

        bodies    (p, 6) states of the bodies: x, y, angle, vx, vy, ...
        robot     x, y, radius, m
        openings  (d,) opening angles of the doors, as shares of the angle when open
        """
        people = self._people
        brake = BRAKING_FORCE_SHARE * people.force / people.mass
        passable = openings >= PASSABLE_SHARE
        arrived = steer(time, dt, bodies, robot, passable & passable[self._other_leaf],
                        Routes(self._routes, self._lengths, self._gates),
                        WalkState(self._state, self._clock, self._ways),
                        (people.radius, people.speed, people.patience, brake),
                        self.velocities)  # fmt: skip
        if arrived:
            resting = np.isinf(self._clock[:, 0])
            self._clock[resting, 0] = time + self._pauses()[resting, 0]

    def _pauses(self) -> Array:
        low, high = self._people.pause_min, self._people.pause_max
        return self._rng.uniform(low, high, (len(self._routes), 1))


def _closed(doors: tuple[Door, ...], beyond: float) -> Array:
    """(d, 4) m, segments from the hinges to the free edges of the closed leaves, or to points so
    far beyond these."""
    return np.array([(*door.hinge, *_free_edge(door, beyond)) for door in doors]).reshape(-1, 4)


def _free_edge(door: Door, beyond: float) -> tuple[float, float]:
    reach = door.width + beyond
    return door.hinge[0] + reach * math.cos(door.closed), (
        door.hinge[1] + reach * math.sin(door.closed)
    )


@kernel
def other_leaves(leaves):
    """(d,) for each of the closed `leaves` (d, 4) of a double door the other one, for others
    itself."""
    other = np.arange(len(leaves))
    for i in range(len(leaves)):
        for j in range(i):
            apart = math.hypot(leaves[i, 2] - leaves[j, 2], leaves[i, 3] - leaves[j, 3])
            if apart < 3 * LATCH_GAP:
                other[i], other[j] = j, i
    return other
