"""FloorPlan: rectangular spaces and the doorways between them, the basis of all worlds."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from dynslam_env.worlds.layout import LATCH_GAP, Door
from dynslam_env.worlds.outline import Rect, outline
from slam.errors import InputError
from slam.geometry import Array
from slam.kernel import kernel
from slam.validation import instance, number, one_of, positive, positive_number, whole_number

ROUNDING_ERROR = 1e-9  # m


class Doorway(NamedTuple):
    """An opening in the wall between two spaces; the wall has no thickness where they touch.

    spaces     indices of the two spaces, in any order
    start      m, start of the opening: its x in a level wall, its y in an upright one
    width      m, of the opening
    opens_to   index of the space into which the leaf opens; None: no leaf
    at_start   whether the leaf is hinged at the start of the opening, else at its end
    double     whether there are two leaves, one at each end, each half as wide
    slides     whether the leaves slide into the wall instead of turning
    """

    spaces: tuple[int, int]
    start: float
    width: float
    opens_to: int | None = None
    at_start: bool = True
    double: bool = False
    slides: bool = False

    def halves(self) -> tuple[Doorway, ...]:
        """A doorway with one leaf for each leaf; empty without a leaf."""
        if self.opens_to is None:
            return ()
        if not self.double:
            return (self,)
        half = self._replace(width=self.width / 2, double=False)
        far = self.start + self.width / 2
        return half._replace(at_start=True), half._replace(start=far, at_start=False)


class Wall(NamedTuple):
    """The wall between two spaces.

    level      whether the wall runs along x, else along y
    low, high  m, its two faces: y of a level wall, x of an upright one
    lower      index of the space on the low side
    start      m along the wall, start of the part that both spaces share
    stop       m, end of that part
    """

    level: bool
    low: float
    high: float
    lower: int
    start: float
    stop: float


def wall_between(spaces: tuple[Rect, ...], a: int, b: int) -> Wall | None:
    """The wall between spaces `a` and `b`; None if they overlap or do not face each other."""
    first, second = spaces[a], spaces[b]
    for level in (True, False):
        axis = 1 if level else 0
        lower, (one, other) = a, (first, second)
        if second[axis] < first[axis]:
            lower, (one, other) = b, (second, first)
        start = max(one[1 - axis], other[1 - axis])
        stop = min(one[3 - axis], other[3 - axis])
        if one[2 + axis] <= other[axis] and start < stop:
            return Wall(level, one[2 + axis], other[axis], lower, start, stop)
    return None


@dataclass(frozen=True)
class FloorPlan:
    """Axis-aligned plan of a floor.

    spaces          rooms and passages, m; they do not overlap
    doorways        openings between spaces
    door_thickness  m, of the leaves; a leaf hangs in the middle of its wall
    """

    spaces: tuple[Rect, ...]
    doorways: tuple[Doorway, ...]
    door_thickness: float = 0.04
    _walls: dict[tuple[int, int], Wall | None] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )

    def __post_init__(self) -> None:
        positive(self, "door_thickness")
        if not _plainly_right(self.spaces):
            for i, space in enumerate(self.spaces):
                _check_space(f"FloorPlan.spaces[{i}]", space)
            self._check_overlap()
        for i, doorway in enumerate(self.doorways):
            if not self._plainly_fits(doorway):
                self._check_doorway(f"FloorPlan.doorways[{i}]", doorway)

    def _check_overlap(self) -> None:
        left, bottom, right, top = np.array(self.spaces).reshape(-1, 4).T
        beside = (left[:, None] < right) & (bottom[:, None] < top)
        overlap = np.argwhere(np.triu(beside & beside.T, 1))
        if len(overlap):
            i, j = overlap[0].tolist()
            raise InputError(f"FloorPlan.spaces must not overlap, but [{i}] and [{j}] do")

    def _plainly_fits(self, doorway: Doorway) -> bool:
        """Whether a doorway needs no further check: a fifth of the time of `_check_doorway`."""
        if type(doorway) is not Doorway or type(doorway.spaces) is not tuple:
            return False
        pair, start, width, into = doorway[:4]
        if [*map(type, (*pair, start, width))] != [int, int, float, float] or min(pair) < 0:
            return False
        wall = self._wall(pair) if max(pair) < len(self.spaces) else None
        return (
            wall is not None
            and (into is None or into in pair)
            and wall.start - ROUNDING_ERROR <= start < start + width <= wall.stop + ROUNDING_ERROR
            and (into is None or wall.high - wall.low >= self.door_thickness)
        )

    def _check_doorway(self, name: str, doorway: Doorway) -> None:
        instance(name, doorway, Doorway)
        for each in doorway.spaces:
            whole_number(f"{name}.spaces", each, 0)
            number(f"{name}.spaces", each, 0, len(self.spaces) - 1)
        one_of(f"{name}.opens_to", doorway.opens_to, (None, *doorway.spaces))
        number(f"{name}.start", doorway.start)
        positive_number(f"{name}.width", doorway.width)
        wall = self._wall(doorway.spaces)
        stop = doorway.start + doorway.width
        if (
            wall is None
            or doorway.start < wall.start - ROUNDING_ERROR
            or stop > wall.stop + ROUNDING_ERROR
        ):
            has = "none" if wall is None else f"one from {wall.start:g} to {wall.stop:g} m"
            raise InputError(
                f"{name} needs a wall between its spaces from {doorway.start:g} to {stop:g} m, "
                f"there is {has}"
            )
        if doorway.opens_to is not None and wall.high - wall.low < self.door_thickness:
            raise InputError(
                f"{name} has a leaf of {self.door_thickness:g} m, thicker than its wall of "
                f"{wall.high - wall.low:g} m"
            )

    def wall(self, doorway: Doorway) -> Wall:
        """The wall of `doorway`."""
        wall = self._wall(doorway.spaces)
        assert wall is not None  # checked by __post_init__
        return wall

    def _wall(self, pair: tuple[int, int]) -> Wall | None:
        if pair not in self._walls:
            self._walls[pair] = wall_between(self.spaces, *pair)
        return self._walls[pair]

    @staticmethod
    def known(
        spaces: tuple[Rect, ...], doorways: tuple[Doorway, ...], door_thickness: float,
        walls: dict[tuple[int, int], Wall] | None = None,
    ) -> FloorPlan:  # fmt: skip
        """A plan that the caller knows to be right: it is not checked.

        walls  that `wall_between` gave for pairs of spaces, as far as they are known
        """
        plan = object.__new__(FloorPlan)
        plan.__dict__.update(
            spaces=spaces,
            doorways=doorways,
            door_thickness=door_thickness,
            _walls={**(walls or {})},
        )
        return plan

    def with_doorways(self, doorways: Sequence[Doorway]) -> FloorPlan:
        """The same spaces with other doorways, which the caller knows to lie in their walls: they
        are not checked."""
        plan = FloorPlan.known(self.spaces, tuple(doorways), self.door_thickness)
        object.__setattr__(plan, "_walls", self._walls)
        return plan

    @cached_property
    def walls(self) -> Array:
        """(w, 4) segments x1, y1, x2, y2, m, around the free space."""
        return outline([*self.spaces, *(self.opening(each) for each in self.doorways)])

    @cached_property
    def doors(self) -> tuple[Door, ...]:
        """The leaves, in the order of their doorways."""
        return tuple(leaf for each in self.doorways for leaf in self.leaves(each))

    @property
    def leaf_count(self) -> int:
        """The number of `doors`, which need not be made for it."""
        return sum(len(each.halves()) for each in self.doorways)

    def opening(self, doorway: Doorway) -> Rect:
        """The area of the opening in the wall, m."""
        wall, stop = self.wall(doorway), doorway.start + doorway.width
        if wall.level:
            return Rect(doorway.start, wall.low, stop, wall.high)
        return Rect(wall.low, doorway.start, wall.high, stop)

    def leaves(self, doorway: Doorway) -> tuple[Door, ...]:
        """The leaves in `doorway`: none, one or two."""
        return tuple(self.leaf(half) for half in doorway.halves())

    def leaf(self, doorway: Doorway) -> Door:
        """The leaf in `doorway`, which has one, and opens to `doorway.opens_to`."""
        wall = self.wall(doorway)
        side = -1 if doorway.opens_to == wall.lower else 1
        across = (wall.low + wall.high + side * self.door_thickness) / 2
        along = doorway.start if doorway.at_start else doorway.start + doorway.width
        sizes = doorway.width - LATCH_GAP, self.door_thickness, doorway.slides
        if wall.level:
            closed = 0.0 if doorway.at_start else math.pi
            return Door((along, across), closed, side if doorway.at_start else -side, *sizes)
        closed = math.pi / 2 if doorway.at_start else -math.pi / 2
        return Door((across, along), closed, -side if doorway.at_start else side, *sizes)


def _plainly_right(spaces: tuple[Rect, ...]) -> bool:
    """Whether spaces need no further check."""
    sides = np.array(spaces) if spaces and {*map(type, spaces)} == {Rect} else np.empty(0)
    return sides.ndim == 2 and sides.dtype == np.float64 and _apart(sides)


@kernel
def _apart(spaces):
    """Whether all rectangles (n, 4) are finite and have an area, and no two overlap."""
    for i in range(len(spaces)):
        left, bottom, right, top = spaces[i]
        if not (-math.inf < left < right < math.inf and -math.inf < bottom < top < math.inf):
            return False
        for j in range(i):
            beside = left < spaces[j, 2] and spaces[j, 0] < right
            if beside and bottom < spaces[j, 3] and spaces[j, 1] < top:
                return False
    return True


def _check_space(name: str, space: Rect) -> None:
    instance(name, space, Rect)
    for side, value in zip(Rect._fields, space, strict=True):
        number(f"{name}.{side}", value)
    if not (space.left < space.right and space.bottom < space.top):
        raise InputError(f"{name} needs left < right and bottom < top, got {space}")
