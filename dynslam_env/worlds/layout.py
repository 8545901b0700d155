"""Layout: walls, doors, start, path and people's routes of a world; Generator: draws layouts."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol, runtime_checkable

import numpy as np

from dynslam_env.worlds import world_file
from slam.errors import InputError
from slam.geometry import Array, Pose2, wrap_angle
from slam.io.files import AnyPath
from slam.validation import finite, instance, number, one_of, positive_number

LEAF_CORNERS = 4  # of each leaf
LATCH_GAP = 0.002  # m between a closed leaf and the jamb, so that its outer corner passes


class Door(NamedTuple):
    """A leaf. It turns about `hinge`, a corner of the leaf on the side to which it opens, or slides
    along its wall, beyond the hinge.

    hinge      (x, y) in m, world
    closed     rad, direction from the hinge along the closed leaf, world
    swing      +1 opens counter-clockwise, -1 clockwise
    width      m, from the hinge to the free edge
    thickness  m, measured away from the side to which the leaf opens
    slides     whether the leaf slides: open, its free edge is where the closed leaf's hinge is
    """

    hinge: tuple[float, float]
    closed: float
    swing: int
    width: float
    thickness: float
    slides: bool = False

    def place(self, opened: float, angle: float) -> tuple[float, float, float]:
        """x and y in m of the leaf's corner at the hinge, and its direction in rad, when the share
        `opened` of a full opening of `angle` rad is open."""
        x, y = self.hinge
        if not self.slides:
            return x, y, self.closed + self.swing * angle * opened
        way = self.width * opened
        return x - way * math.cos(self.closed), y - way * math.sin(self.closed), self.closed

    @property
    def middle(self) -> Array:
        """(2,) m, the middle of the closed leaf."""
        along = np.array([np.cos(self.closed), np.sin(self.closed)])
        across = self.swing * self.thickness * np.array([-along[1], along[0]])
        return np.array(self.hinge) + 0.5 * (self.width * along - across)

    @property
    def corners(self) -> Array:
        """(4, 2) corners of the leaf, m, in its frame: origin at the hinge, x along the leaf."""
        return corners_of([self])[0]


def corners_of(doors: Sequence[Door]) -> Array:
    """(d, 4, 2) m, the `corners` of leaves."""
    corners = np.zeros((len(doors), LEAF_CORNERS, 2))
    if doors:
        sizes = np.array([(door.width, -door.swing * door.thickness) for door in doors])
        corners[:, 1:3, 0], corners[:, 2:, 1] = sizes[:, :1], sizes[:, 1:]
    return corners


@dataclass(frozen=True, eq=False)  # == of arrays gives an array; compare `plain()`
class Layout:
    """A world: walls, doors, start pose, path of the robot, routes of the people.

    walls   (w, 4) segments x1, y1, x2, y2, m
    doors   hinged leaves
    start   start pose of the robot
    path    (p, 2) waypoints of the robot, m
    routes  per person (k, 2) waypoints, m, k >= 2, between which the person walks back and forth

    Lists are converted to arrays. A Layout is also a Generator, which always returns itself.
    """

    walls: Array
    doors: tuple[Door, ...]
    start: Pose2
    path: Array
    routes: tuple[Array, ...] = ()

    def __post_init__(self) -> None:
        if np.shape(self.start) != (3,):
            raise InputError(f"Layout.start must be three numbers x, y, theta, got {self.start!r}")
        finite("Layout.start", self.start)
        self._keep("start", Pose2.of(self.start))
        self._keep("walls", _rows("Layout.walls", self.walls, 4))
        self._keep("path", _rows("Layout.path", self.path, 2))
        self._keep("doors", _doors(self.doors))
        routes = enumerate(self.routes)
        self._keep("routes", tuple(_rows(f"Layout.routes[{i}]", r, 2) for i, r in routes))
        self._check()

    def _keep(self, field: str, value: object) -> None:
        object.__setattr__(self, field, value)

    def _check(self) -> None:
        if not len(self.path):
            raise InputError("Layout.path needs at least one waypoint, got none")
        x1, y1, x2, y2 = self.walls.T
        points = np.flatnonzero((x1 == x2) & (y1 == y2))
        if len(points):
            x, y = self.walls[points[0], :2].tolist()
            raise InputError(f"Layout.walls[{points[0]}] has no length: ({x:g}, {y:g}) twice")
        for i, route in enumerate(self.routes):
            if len(route) < 2 or not (route[1:] != route[:-1]).any(axis=1).all():
                raise InputError(
                    f"Layout.routes[{i}] needs at least two waypoints, each another than the one "
                    f"before, got {route.tolist()}"
                )

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Protect the arrays of a copy from changes."""
        self.__dict__.update(state)
        for array in (self.walls, self.path, *self.routes):
            array.flags.writeable = False

    def layout(self, rng: np.random.Generator) -> Layout:
        """Return itself: the same layout in every episode."""
        return self

    def turned(self, angle: float, to: Array | None = None) -> Layout:
        """The same world turned about the origin by `angle` rad, counter-clockwise; then moved so
        that the origin comes `to` (2,), m, if given."""
        walls = _turned(self.walls.reshape(-1, 2), angle, to).reshape(-1, 4)
        x, y = _turned(np.array([self.start[:2]]), angle, to)[0].tolist()
        start = Pose2(x, y, float(wrap_angle(self.start.theta + angle)))
        routes = tuple(_turned(route, angle, to) for route in self.routes)
        hinges = _turned(np.array([door.hinge for door in self.doors]).reshape(-1, 2), angle, to)
        closed = wrap_angle([door.closed + angle for door in self.doors]).tolist()
        doors = tuple(
            Door((x, y), direction, *door[2:])
            for door, (x, y), direction in zip(self.doors, hinges.tolist(), closed, strict=True)
        )
        return Layout.known(walls, doors, start, _turned(self.path, angle, to), routes)

    @staticmethod
    def known(
        walls: Array, doors: tuple[Door, ...], start: Pose2, path: Array, routes: tuple[Array, ...]
    ) -> Layout:
        """A layout of arrays of float64 and parts that the caller knows to be right, as those of a
        `FloorPlan` are: they are neither checked nor copied."""
        layout = object.__new__(Layout)
        layout.__setstate__(
            {"walls": walls, "doors": doors, "start": start, "path": path, "routes": routes}
        )
        return layout

    def plain(self) -> dict[str, Any]:
        """Its content as lists, numbers and dicts: the content of a world file."""
        return {
            "walls": self.walls.tolist(),
            "doors": [_plain(door) for door in self.doors],
            "start": list(self.start),
            "path": self.path.tolist(),
            "routes": [route.tolist() for route in self.routes],
        }

    def save(self, path: AnyPath) -> None:
        """Write to a world file (JSON), which can be edited; see `world_file`."""
        world_file.write(path, self.plain())

    @staticmethod
    def load(path: AnyPath) -> Layout:
        """Read a world file, bit for bit what was saved. Raises InputError for any other file."""
        world = world_file.read(path)
        doors = tuple(Door(**{**door, "hinge": tuple(door["hinge"])}) for door in world["doors"])
        walls = np.array(world["walls"]).reshape(-1, 4)
        way = np.array(world["path"]).reshape(-1, 2)
        routes = tuple(np.array(route).reshape(-1, 2) for route in world["routes"])
        try:
            return Layout(walls, doors, Pose2(*world["start"]), way, routes)
        except InputError as error:
            raise InputError(f"{path}: {error}") from None


def _turned(points: Array, angle: float, to: Array | None) -> Array:
    """Points (n, 2) turned about the origin; bit for bit the same wherever a point stands."""
    c, s, turned = math.cos(angle), math.sin(angle), np.empty_like(points)
    x, y = points.T
    turned[:, 0], turned[:, 1] = c * x - s * y, s * x + c * y
    return turned if to is None else turned + to


def _plain(door: Door) -> dict[str, Any]:
    numbers = {key: float(getattr(door, key)) for key in ("closed", "width", "thickness")}
    x, y = door.hinge
    plain = {"hinge": [float(x), float(y)], "swing": int(door.swing), **numbers}
    return plain | {"slides": True} if door.slides else plain


def _rows(name: str, values: Array, columns: int) -> Array:
    try:
        array = np.asarray(values)
    except ValueError:  # rows of different lengths
        raise InputError(f"{name} must have shape (n, {columns}), got {values!r}") from None
    if array.size == 0:
        array = array.reshape(0, columns)
    finite(name, array, columns)
    rows = array.astype(np.float64)
    rows.flags.writeable = False  # shared by all episodes
    return rows


def _doors(doors: Iterable[Door]) -> tuple[Door, ...]:
    """Check doors; their hinges become pairs of floats."""
    doors = tuple(doors)
    if all(map(_plainly_right, doors)):
        return doors
    return tuple(_door(f"Layout.doors[{i}]", door) for i, door in enumerate(doors))


def _plainly_right(door: Door) -> bool:
    """Whether a door needs no further check: a fifth of the time of `_door`."""
    if type(door) is not Door or type(door.hinge) is not tuple or len(door.hinge) != 2:
        return False
    (x, y), closed, swing, width, thickness, slides = door
    return (
        type(x) is type(y) is type(closed) is type(width) is type(thickness) is float
        and type(swing) is int
        and type(slides) is bool
        and (swing == 1 or swing == -1)
        and -math.tau <= closed <= math.tau
        and 0.0 < width < math.inf
        and 0.0 < thickness < math.inf
        and math.isfinite(x + y)
    )


def _door(name: str, door: Door) -> Door:
    """Check a door; its hinge becomes two floats."""
    instance(name, door, Door)
    if np.shape(door.hinge) != (2,):
        raise InputError(f"{name}.hinge must be two numbers x, y, got {door.hinge!r}")
    finite("a door of Layout.doors", (*door.hinge, *door[1:5]))
    instance(f"{name}.slides", door.slides, bool)
    number(f"{name}.closed, in rad,", door.closed, -math.tau, math.tau)
    one_of(f"{name}.swing", door.swing, (1, -1))
    positive_number(f"{name}.width", door.width)
    positive_number(f"{name}.thickness", door.thickness)
    x, y = door.hinge
    return door._replace(hinge=(float(x), float(y)))


@runtime_checkable
class Generator(Protocol):
    """Draws layouts, one per episode.

    ```python
    class Room:
        def layout(self, rng):
            width = rng.uniform(3.0, 5.0)
            walls = [(0, 0, 6, 0), (6, 0, 6, width), (6, width, 0, width), (0, width, 0, 0)]
            return dynslam_env.Layout(walls, (), (1.0, 1.0, 0.0), [(5.0, 1.0)])

    dynslam_env.register_world("room", Room())
    env = gym.make("DoorCorridor-v0", world="room")
    ```
    """

    def layout(self, rng: np.random.Generator) -> Layout:
        """A new layout; the same state of `rng` gives the same layout."""
        ...
