"""FromMap: a place that was mapped, as a world whose found doors move."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import NamedTuple

import numpy as np

from dynslam_env.worlds.layout import Door, Layout
from dynslam_env.worlds.map_doors import hung, read_gaps, swept
from dynslam_env.worlds.map_routes import FreeSpace
from dynslam_env.worlds.map_walls import walls_of
from slam.geometry import Array, Pose2
from slam.grid import OccupancyGrid
from slam.io.ros_map import read_placed_map
from slam.validation import positive, within

MAP_FILE, DOORS_FILE = "map.yaml", "doors.geojson"  # in a folder of `dynslam map`


@dataclass(frozen=True)
class FromMap:
    """A place from a ROS map (`map.yaml` and its picture), or from a folder of `dynslam map`.

    The outlines of occupied cells become walls. Doors are those of `doors.geojson` beside the map,
    if it is there; which end is hinged and to which side a leaf opens is chosen so that walls are
    least in its way. What the map does not know is empty, and a fence stands around the map. Each
    episode has a random start and a random path, there and back, through known free space that no
    leaf sweeps: the path is free whatever the doors do. There are no people.

    path              of the YAML, or of the folder with map.yaml
    length            m, of the path out and back, at most
    clearance         m, that the path keeps from walls, leaves and the unknown
    tolerance         m, by which walls may deviate from the outlines of the cells
    least_probability  of the doors that are taken, 0 to 1
    content           digest of the files, so that a changed map is another world

    Raises InputError for a map that cannot be read, or that has no free space.
    """

    path: str | Path
    length: float = 40.0
    clearance: float = 0.4
    tolerance: float = 0.04
    least_probability: float = 0.5
    content: str = field(init=False, default="")

    def __post_init__(self) -> None:
        positive(self, "length", "clearance", "tolerance")
        within(self, "least_probability", 0.0, 1.0)
        object.__setattr__(self, "path", str(self.path))  # plain data in `config`
        object.__setattr__(self, "content", self._place.content)

    @cached_property
    def _place(self) -> MappedPlace:
        path = Path(self.path)
        path = path / MAP_FILE if path.is_dir() else path
        grid, frame = read_placed_map(path)
        doors = path.with_name(DOORS_FILE)
        gaps = read_gaps(doors, self.least_probability) if doors.is_file() else []
        corner = np.array([frame.x, frame.y])
        walls = walls_of(grid, self.tolerance) + np.tile(corner, 2)
        leaves = tuple(hung(gap, walls) for gap in gaps)
        space = FreeSpace(grid.spec, _free(grid, leaves, corner), self.clearance)
        return MappedPlace(walls, leaves, space, corner, _digest(grid, gaps))

    def layout(self, rng: np.random.Generator) -> Layout:
        """The place with a random start, and a random path there and back."""
        place = self._place
        there = place.space.draw_path(self.length / 2, rng) + place.corner
        path = np.vstack([there, there[-2::-1]])
        (x, y), (x2, y2) = path[:2].tolist()
        start = Pose2(x, y, math.atan2(y2 - y, x2 - x))
        return Layout(place.walls, place.doors, start, path)


class MappedPlace(NamedTuple):
    """What a map gives.

    walls    (w, 4) m
    doors    hinged leaves
    space    where the robot can drive, in the frame of the grid
    corner   (2,) m, origin of that frame
    content  digest
    """

    walls: Array
    doors: tuple[Door, ...]
    space: FreeSpace
    corner: Array
    content: str


def _free(grid: OccupancyGrid, doors: tuple[Door, ...], corner: Array) -> np.ndarray:
    """(rows, cols) bool: known to be free, and swept by no leaf."""
    free = grid.observed & ~grid.solid
    for door in doors:
        reach, middle = door.width + door.thickness, np.array(door.hinge) - corner
        low, high = grid.spec.cells(np.array([middle - reach, middle + reach])).tolist()
        rows, cols = (np.arange(max(a, 0), max(b + 1, 0)) for a, b in zip(low, high, strict=True))
        cells = np.argwhere(np.ones((len(rows), len(cols)))) + (rows[:1].sum(), cols[:1].sum())
        cells = cells[(cells < grid.spec.shape).all(axis=1)]
        cells = cells[swept(door, grid.spec.centres(cells) + corner)]
        free[tuple(cells.T)] = False
    return free


def _digest(grid: OccupancyGrid, gaps: list[Array]) -> str:
    content = hashlib.sha256(repr(grid.spec).encode() + grid.solid.tobytes())
    for part in (grid.observed, *gaps):
        content.update(part.tobytes())
    return content.hexdigest()[:16]
