"""People who walk to and fro: along a route, around each other, and not through closed doors."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from dynslam_env.simulation.walking import Routes, WalkState, steer
from dynslam_env.worlds.clearance import any_crossing
from dynslam_env.worlds.layout import Layout
from slam.errors import InputError
from slam.geometry import Array
from slam.validation import positive, within

OPEN_ENOUGH = 0.75  # share of a door's opening angle from which on people walk through
BRAKING = 0.7  # share of the force that is reckoned with where people must stand


@dataclass(frozen=True)
class People:
    """How people walk. Where they walk is the layout's `routes`, one a person.

    radius       m, of the regular octagon that the laser sees and the robot runs into
    speed        m/s
    pause_min    s, of rest at either end of a route, drawn from U(pause_min, pause_max)
    pause_max    s
    patience     s: who cannot go on for longer turns around
    mass         kg
    force        N, with which they push at most
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
    """One episode's people, and where each wants to go.

    A person begins a leg of the route that leads through a door when that door is open and nobody
    else is passing through. Who is stopped by something ahead steps aside from it, to the right if
    it is straight ahead, and at last turns around. Who stands steps aside for those who walk.

    velocities (p, 2) m/s, as wanted
    """

    def __init__(self, people: People, layout: Layout, rng: np.random.Generator):
        count = len(layout.routes)
        longest = max((len(route) for route in layout.routes), default=2)
        self._people, self._rng = people, rng
        self._routes = np.zeros((count, longest, 2))
        self._gates = np.full((count, longest - 1), -1, dtype=np.int64)
        for i, route in enumerate(layout.routes):
            self._routes[i, : len(route)] = route
            self._gates[i, : len(route) - 1] = [
                _door_between(a, b, layout) for a, b in pairwise(route)
            ]
        lengths = [len(route) for route in layout.routes]
        self._lengths = np.array(lengths, dtype=np.int64)
        self._state = np.zeros((count, 3), dtype=np.int64)  # at waypoint, to waypoint, walking
        self._state[:, 1] = 1
        self._clock = np.zeros((count, 2))  # rests until, s; cannot go on since so many s
        self._ways = np.zeros((count, 2))  # unit vector to where they walk; zero for who stands
        self._clock[:, 0] = self._pauses()[:count, 0] if count else 0.0
        self.velocities = np.zeros((count, 2))

    def beginnings(self) -> Array:
        """(p, 2) m, where people stand at first: at the beginnings of their routes.

        Who would stand on another's feet stands beside.
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
        """Set what velocities are wanted for the next `dt` s.

        bodies    (p, 6) as the physics has them: x, y, angle, vx, vy, ...
        robot     x, y, radius, m
        openings  (d,) of doors as shares of their opening angles
        """
        people = self._people
        brake = BRAKING * people.force / people.mass
        arrived = steer(time, dt, bodies, robot, openings >= OPEN_ENOUGH,
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


def _door_between(a: Array, b: Array, layout: Layout) -> int:
    """The door through which a leg from `a` to `b` leads; -1 for none."""
    leg = np.array([(*a, *b)])
    for number, door in enumerate(layout.doors):
        x, y = door.hinge
        edge = x + door.width * math.cos(door.closed), y + door.width * math.sin(door.closed)
        if any_crossing(leg, np.array([(x, y, *edge)])):
            return number
    return -1
