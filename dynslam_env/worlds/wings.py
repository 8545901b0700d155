"""Wings: corridors one after the other, that meet at angles other than right ones."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from dynslam_env.worlds.clearance import clear, edges
from dynslam_env.worlds.corridor import Corridor
from dynslam_env.worlds.layout import Layout
from slam.errors import InputError
from slam.geometry import Array
from slam.validation import instance, number, whole, within

MAX_TRIES = 100  # draws of the bends, until no wing lies over another
APART = 0.2  # m, between the rooms of two wings
MAX_BEND = math.radians(75)
ROUNDING_ERROR = 1e-6  # m


class _Place(NamedTuple):
    """Where a corridor with its rooms stands: `start` and `end` of its passage, m, its direction,
    rad, and the outline of all, (4, 4) m."""

    heading: float
    start: Array
    end: Array
    outline: Array


class _Wing(NamedTuple):
    """A corridor with its rooms, at its place: a straight part of the building."""

    layout: Layout
    start: Array
    end: Array


@dataclass(frozen=True)
class Wings:
    """Corridors with rooms, joined end to end at oblique angles, left or right; there are double
    and sliding doors among the hinged ones.

    wings       number of corridors
    corridor    what each is drawn from; the path leads from the first to the last, and back
    least_bend  rad, smallest angle by which a corridor turns away from the one before
    most_bend   rad, largest angle
    """

    wings: int = 3
    corridor: Corridor = field(
        default=Corridor(length=9.0, doors_per_side=3, doubled=0.3, sliding=0.4, narrowest=0.8)
    )
    least_bend: float = math.radians(20)
    most_bend: float = math.radians(65)

    def __post_init__(self) -> None:
        whole(self, "wings", 1)
        instance("Wings.corridor", self.corridor, Corridor)
        within(self, "least_bend", 0.0, MAX_BEND)
        number("Wings.most_bend, in rad,", self.most_bend, self.least_bend, MAX_BEND)

    def layout(self, rng: np.random.Generator) -> Layout:
        """A layout with random wings, bends and doors."""
        parts = [self.corridor.layout(rng) for _ in range(self.wings)]
        for _ in range(MAX_TRIES):
            count = self.wings - 1
            bends = rng.uniform(self.least_bend, self.most_bend, count)
            places = self._places(bends * rng.choice((-1.0, 1.0), count))
            if _apart([place.outline for place in places]):
                return self._joined([_wing(*both) for both in zip(parts, places, strict=True)])
        raise InputError(
            f"in {MAX_TRIES} draws some of {self.wings} wings lay over each other; take fewer, "
            f"longer corridors, or a smaller Wings.most_bend than {self.most_bend:g} rad"
        )

    def _places(self, bends: Array) -> list[_Place]:
        """The places of the wings: the first along x, from the origin."""
        corridor, places = self.corridor, []
        half = corridor.width / 2 + corridor.wall_thickness + corridor.room_depth
        corners = np.array([(0.0, -half), (corridor.length, -half), (corridor.length, half),
                            (0.0, half)])  # fmt: skip
        place, heading = np.zeros(2), 0.0
        for bend in [*bends.tolist(), 0.0]:
            turn = np.array([(math.cos(heading), math.sin(heading)),
                             (-math.sin(heading), math.cos(heading))])  # fmt: skip
            end = place + corridor.length * turn[0]
            places.append(_Place(heading, place, end, edges(place + corners @ turn)))
            joint = (half + APART) * math.tan(abs(bend) / 2)  # from the end to where the axes meet
            corner = end + joint * turn[0]
            heading += bend
            place = corner + joint * np.array((math.cos(heading), math.sin(heading)))
        return places

    def _joined(self, wings: list[_Wing]) -> Layout:
        """One layout of all wings."""
        first, walls = wings[0].layout, []
        for k, wing in enumerate(wings):
            open_ends = [wing.start] * (k > 0) + [wing.end] * (k < len(wings) - 1)
            half = self.corridor.width / 2
            walls.append(_without_ends(wing.layout.walls, open_ends, _direction(wing), half))
        for one, other in itertools.pairwise(wings):
            walls += [_joint(one, other, side * self.corridor.width / 2) for side in (1, -1)]
        middles = [_meeting(one, other) for one, other in itertools.pairwise(wings)]
        there = [wings[0].layout.path[0], *middles, wings[-1].layout.path[1]]
        path = np.array([*there, *there[-2::-1]])
        doors = tuple(door for wing in wings for door in wing.layout.doors)
        routes = tuple(route for wing in wings for route in wing.layout.routes)
        return Layout.known(np.vstack(walls), doors, first.start, path, routes)


def _wing(part: Layout, place: _Place) -> _Wing:
    """The corridor `part` at its place."""
    return _Wing(part.turned(place.heading, place.start), place.start, place.end)


def _apart(outlines: list[Array]) -> bool:
    """Whether no wing lies over another."""
    return all(
        clear(one, other, APART / 2) for i, one in enumerate(outlines) for other in outlines[:i]
    )


def _direction(wing: _Wing) -> Array:
    return (wing.end - wing.start) / math.dist(wing.end, wing.start)


def _meeting(one: _Wing, other: _Wing) -> Array:
    """Where the axes of two wings, of which the second follows the first, meet, m."""
    return _crossing(one.end, _direction(one), other.start, _direction(other))


def _crossing(p: Array, u: Array, q: Array, v: Array) -> Array:
    """Where the lines p + s u and q + t v cross; midway between p and q where they are parallel."""
    across = u[0] * v[1] - u[1] * v[0]
    if abs(across) < 1e-9:
        return (p + q) / 2
    away = q - p
    return p + u * ((away[0] * v[1] - away[1] * v[0]) / across)


def _joint(one: _Wing, other: _Wing, offset: float) -> Array:
    """(2, 4) m, the walls of the joint on one side, `offset` m to the left of the axis."""
    u, v = _direction(one), _direction(other)
    a = one.end + offset * np.array((-u[1], u[0]))
    b = other.start + offset * np.array((-v[1], v[0]))
    corner = _crossing(a, u, b, v)
    return np.array([(*a, *corner), (*corner, *b)])


def _without_ends(walls: Array, ends: list[Array], axis: Array, half: float) -> Array:
    """The walls without those that close the passage, `half` m to each side of its `axis`, at these
    `ends`: the end wall, and oblique walls before its corners."""
    points = np.stack([walls[:, :2], walls[:, 2:], (walls[:, :2] + walls[:, 2:]) / 2])
    kept = np.ones(len(walls), dtype=np.bool_)
    for end in ends:
        away = points - end
        ahead, aside = np.abs(away @ axis), np.abs(away @ np.array((-axis[1], axis[0])))
        kept &= ~((ahead < ROUNDING_ERROR) & (aside < half - ROUNDING_ERROR)).any(axis=0)
    return walls[kept]
