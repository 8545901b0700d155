"""Variety of a floor plan: doors of unequal widths, furnished rooms, and cut corners."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from dynslam_env.worlds.clearance import clear, clear_of_legs, edges, legs, sweep
from dynslam_env.worlds.floor_plan import Doorway, FloorPlan
from dynslam_env.worlds.furniture import PIECE_CLEARANCE, furnish
from dynslam_env.worlds.outline import Rect
from dynslam_env.worlds.routes import Solid, waiting_point
from slam.geometry import Array
from slam.validation import within

CUT_SHARE = 0.6  # of the corners, that is cut where it is clear of ways and leaves
FREE_WAY = 0.47  # m: the robot's radius plus its deviation from the path
MIN_NARROWEST = 0.5  # of the full width of a door
SWEEP_CLEARANCE = 0.1  # m, between the areas that the leaves of two doorways sweep
MIN_CUT = 0.4  # of the longest cut, the shortest one
SMALLEST = 0.005  # m, of what is drawn: a leaf has 2 mm of play


@dataclass(frozen=True)
class Free:
    """What obstacles keep clear of.

    ways    (n, 4) segments, m
    sweeps  per space, outlines of the areas that leaves sweep
    space   m, from the ways
    """

    ways: Array
    sweeps: list[list[Array]]
    space: float

    def without(self, solids: list[Solid]) -> Free:
        """Clear of these solids too."""
        taken = [[*swept] for swept in self.sweeps]
        for i, outline in solids:
            taken[i].append(outline)
        return Free(self.ways, taken, self.space)

    @staticmethod
    def of(plan: FloorPlan, path: Array, space: float) -> Free:
        """Clear of the path (p, 2), m, of the ways through all doorways, and of leaves."""
        return Free(np.vstack([legs(path), _crossings(plan)]), _sweeps(plan), space)


def check_sizes(world: Any, *sizes: str) -> None:
    """Check the sizes of doors, walls and these `sizes`, m, and the variety: what is drawn with
    them needs no other checks."""
    for name in ("door_width", "wall_thickness", *sizes):
        within(world, name, SMALLEST)
    within(world, "door_thickness", SMALLEST, world.wall_thickness)
    within(world, "narrowest", MIN_NARROWEST, 1.0)
    within(world, "doubled", 0.0, 1.0)
    within(world, "sliding", 0.0, 1.0)
    within(world, "cut", SMALLEST if world.cut else 0.0)


def narrowed(plan: FloorPlan, least: float, rng: np.random.Generator) -> FloorPlan:
    """The plan with doors of widths drawn from U(`least`, 1) times their own.

    The hinges stay, hence leaves sweep no area that they did not sweep before. For `least` = 1 it
    is the same plan, and nothing is drawn.
    """
    if least == 1.0:
        return plan
    doorways = []
    for doorway, share in zip(
        plan.doorways, rng.uniform(least, 1.0, len(plan.doorways)).tolist(), strict=True
    ):
        if doorway.opens_to is not None:
            width = doorway.width * share
            shift = 0.0 if doorway.at_start else doorway.width - width
            doorway = Doorway(doorway.spaces, doorway.start + shift, width, *doorway[3:])
        doorways.append(doorway)
    return plan.with_doorways(doorways)


def doubled(plan: FloorPlan, share: float, path: Array, rng: np.random.Generator) -> FloorPlan:
    """The plan with two leaves in this share of its doors, where these keep clear of the path
    (p, 2), m, and of other leaves.

    For a share of 0 it is the same plan, and nothing is drawn.
    """
    if share == 0.0:
        return plan
    doorways, way = list(plan.doorways), legs(path)
    swept = [[sweep(leaf) for leaf in plan.leaves(each)] for each in doorways]
    for i, draw in enumerate(rng.random(len(doorways)).tolist()):
        if doorways[i].opens_to is not None and draw < share:
            changed = doorways[i]._replace(double=True)
            sweeps = [sweep(leaf) for leaf in plan.leaves(changed)]
            others = [each for k, other in enumerate(swept) if k != i for each in other]
            if _swing_clear(sweeps, way, others):
                doorways[i], swept[i] = changed, sweeps
    return plan.with_doorways(doorways)


def sliding(plan: FloorPlan, share: float, rng: np.random.Generator) -> FloorPlan:
    """The plan with leaves that slide into the wall in this share of its doors, where the wall
    beside them has room for the open leaves, on the side of the hinge or else on the other.

    For a share of 0 it is the same plan, and nothing is drawn.
    """
    if share == 0.0:
        return plan
    doorways, openings = list(plan.doorways), [plan.opening(each) for each in plan.doorways]
    for i, draw in enumerate(rng.random(len(doorways)).tolist()):
        if doorways[i].opens_to is not None and draw < share:
            slides = doorways[i]._replace(slides=True)
            turned = slides._replace(at_start=not slides.at_start)
            taken = [*plan.spaces, *openings[:i], *openings[i + 1 :]]
            fitting = (each for each in (slides, turned) if _has_pockets(plan, each, taken))
            doorways[i] = next(fitting, doorways[i])
    return plan.with_doorways(doorways)


def _has_pockets(plan: FloorPlan, changed: Doorway, taken: Sequence[Rect]) -> bool:
    """Whether the open leaves of a doorway lie within its wall, and in no area that is `taken`."""
    wall, spaces = plan.wall(changed), [plan.spaces[k] for k in changed.spaces]
    axis = 0 if wall.level else 1
    low, high = min(each[axis] for each in spaces), max(each[axis + 2] for each in spaces)
    for half in changed.halves():
        start = half.start - half.width if half.at_start else half.start + half.width
        pocket = plan.opening(half._replace(start=start))
        if start < low or start + half.width > high or _overlaps(pocket, taken):
            return False
    return True


def _overlaps(one: Rect, others: Sequence[Rect]) -> bool:
    return any(
        one.left < each.right and each.left < one.right
        and one.bottom < each.top and each.bottom < one.top
        for each in others
    )  # fmt: skip


def _swing_clear(sweeps: Sequence[Array], way: Array, others: Sequence[Array]) -> bool:
    """Whether the areas that leaves sweep keep clear of the way (n, 4), m, and of other leaves."""
    return all(
        clear_of_legs(swept, way, FREE_WAY)
        and all(clear(swept, other, SWEEP_CLEARANCE) for other in others)
        for swept in sweeps
    )


class Clutter(NamedTuple):
    """What stands in a floor beside its walls, each with the index of its space.

    cuts    triangles (3, 4), m, behind oblique walls: see `cut_corners`
    pieces  outlines (4, 4), m, of furniture
    """

    cuts: list[Solid]
    pieces: list[Solid]

    @property
    def solids(self) -> list[Solid]:
        """All outlines."""
        return [*self.cuts, *self.pieces]

    def walls(self, plan: FloorPlan) -> Array:
        """(w, 4) m: the walls of the plan, the oblique walls of the cuts, the pieces' edges."""
        if not self.cuts and not self.pieces:
            return plan.walls
        oblique = [triangle[1:2] for _, triangle in self.cuts]
        return np.vstack([plan.walls, *oblique, *(piece for _, piece in self.pieces)])


@dataclass(frozen=True)
class Stands:
    """How much stands in a floor: it draws `Clutter`.

    cut        m, longest side of a cut corner; 0: none
    furniture  pieces in each room
    free_way   m, distance from the path and from the ways through doorways
    """

    cut: float
    furniture: int
    free_way: float = FREE_WAY

    def draw(
        self, plan: FloorPlan, rooms: Sequence[int], path: Array, rng: np.random.Generator
    ) -> Clutter:
        """Cut corners in all spaces, then furniture in the `rooms`; without both, no draw."""
        if not (self.cut or self.furniture):
            return Clutter([], [])
        free = Free.of(plan, path, self.free_way)
        cuts = cut_corners(plan, self.cut, free, rng)
        free = free.without(cuts)
        return Clutter(cuts, [(i, each) for i in rooms for each in self._in(plan, i, free, rng)])

    def _in(self, plan: FloorPlan, i: int, free: Free, rng: np.random.Generator) -> list[Array]:
        room, swept = plan.spaces[i], free.sweeps[i]
        return furnish(room, self.furniture, free.ways, free.space, swept, rng)


def cut_corners(
    plan: FloorPlan, longest: float, free: Free, rng: np.random.Generator
) -> list[Solid]:
    """Triangles (3, 4), m, in corners of spaces, with the indices of the spaces; the second edge is
    an oblique wall.

    Their legs are up to `longest` m; nothing is drawn if it is 0. A corner that is cut has walls on
    both sides, and the triangle is clear of what is `free`.
    """
    if longest == 0.0:
        return []
    cuts = []
    for i, space in enumerate(plan.spaces):
        for triangle in _triangles(space, longest, rng):
            if _in_walls(triangle, plan) and _clear(triangle, free, free.sweeps[i]):
                cuts.append((i, triangle))
    return cuts


def _triangles(space: Rect, longest: float, rng: np.random.Generator) -> Iterator[Array]:
    """Triangles in a share of the corners of a space."""
    limit = min(longest, (space.right - space.left) / 3, (space.top - space.bottom) / 3)
    for x, side_x in ((space.left, 1), (space.right, -1)):
        for y, side_y in ((space.bottom, 1), (space.top, -1)):
            a, b = (limit * rng.uniform(MIN_CUT, 1.0, 2)).tolist()
            if rng.random() < CUT_SHARE:
                yield edges(np.array([(x, y), (x + side_x * a, y), (x, y + side_y * b)]))


def _in_walls(triangle: Array, plan: FloorPlan) -> bool:
    """Whether both legs of the triangle lie in walls, with no doorway beside them."""
    return _on_wall(triangle[0], plan.walls) and _on_wall(triangle[2], plan.walls)


def _on_wall(leg: Array, walls: Array) -> bool:
    """Whether one of the axis-aligned `walls` covers the axis-aligned leg."""
    low, high = np.minimum(leg[:2], leg[2:]), np.maximum(leg[:2], leg[2:])
    lows, highs = np.minimum(walls[:, :2], walls[:, 2:]), np.maximum(walls[:, :2], walls[:, 2:])
    return bool(((lows <= low + 1e-9) & (highs >= high - 1e-9)).all(axis=1).any())


def _clear(triangle: Array, free: Free, sweeps: list[Array]) -> bool:
    return clear_of_legs(triangle, free.ways, free.space) and all(
        clear(triangle, swept, PIECE_CLEARANCE) for swept in sweeps
    )


def _crossings(plan: FloorPlan) -> Array:
    """(n, 4) m, straight ways through all doorways."""
    ends = [
        [*waiting_point(plan, (i, each.spaces[0])), *waiting_point(plan, (i, each.spaces[1]))]
        for i, each in enumerate(plan.doorways)
    ]
    return np.array(ends).reshape(-1, 4)


def _sweeps(plan: FloorPlan) -> list[list[Array]]:
    """Outlines of the areas that leaves sweep in each space."""
    swept: list[list[Array]] = [[] for _ in plan.spaces]
    for doorway in plan.doorways:
        if doorway.opens_to is not None:
            swept[doorway.opens_to] += [sweep(leaf) for leaf in plan.leaves(doorway)]
    return swept
