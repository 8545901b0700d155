"""Memory of the map of a large building of rooms along corridors."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from rich.box import HORIZONTALS
from rich.table import Table

import slam
from dynslam_env import Laser
from dynslam_env.sensors.laser import Scanner
from slam.algorithms.maximum_likelihood import MaximumLikelihood
from slam.benchmark.configuration import configuration
from slam.benchmark.results import Result
from slam.geometry import Array, Pose2
from slam.scan import Scan

from ..console.process_memory import forget_peak, peak_mb, resident_mb
from ..console.progress import ProgressTracker, T
from .memory import map_memory

ROOM_WIDTH, ROOM_DEPTH, CORRIDOR_WIDTH, DOOR_WIDTH = 10.0, 8.5, 3.0, 1.0  # m
BAND_WIDTH = 2 * ROOM_DEPTH + CORRIDOR_WIDTH  # m, a corridor with its rooms
SCAN_DISTANCE, SPEED = 1.0, 1.0  # m between scans, m/s
LASER = Laser(beams=720, field_of_view=math.tau, max_range=30.0, sigma=0.01)
MAX_MAP_MB = 600.0  # larger maps are marked


class Building(NamedTuple):
    """Walls (w, 4), m, and poses (n, 3) along all corridors and into all rooms, band by band."""

    walls: Array
    poses: Array


def building(side: float) -> Building:
    """`side` x `side` m of parallel corridors with rooms on both sides.

    `side` is a multiple of ROOM_WIDTH and of BAND_WIDTH.
    """
    rooms, bands = round(side / ROOM_WIDTH), round(side / BAND_WIDTH)
    walls = [(0.0, 0.0, 0.0, side), (side, 0.0, side, side), (0.0, 0.0, side, 0.0)]
    corners = []
    for band in range(bands):
        foot = band * BAND_WIDTH
        below, above, top = foot + ROOM_DEPTH, foot + ROOM_DEPTH + CORRIDOR_WIDTH, foot + BAND_WIDTH
        walls.append((0.0, top, side, top))
        order = range(rooms) if band % 2 == 0 else reversed(range(rooms))
        for room in range(rooms):
            left, right = room * ROOM_WIDTH, (room + 1) * ROOM_WIDTH
            door = left + (ROOM_WIDTH - DOOR_WIDTH) / 2
            for y in (below, above):
                walls += [(left, y, door, y), (door + DOOR_WIDTH, y, right, y)]
            walls += [(right, foot, right, below), (right, above, right, top)]
        for room in order:
            x = (room + 0.5) * ROOM_WIDTH
            stops = (below + above) / 2, (foot + below) / 2, (above + top) / 2, (below + above) / 2
            corners += [(x, y) for y in stops]
    return Building(np.array(walls), _along(np.array(corners)))


def scans(place: Building, seed: int = 0) -> Iterator[tuple[Pose2, Scan]]:
    """Poses and scans of the drive, made one by one: all together would need more memory than the
    map."""
    rng = np.random.default_rng(seed)
    scanner = Scanner(LASER, rng)
    for number, pose in enumerate(place.poses):
        at = Pose2.of(pose)
        ranges = scanner.exact(at, place.walls) + rng.normal(0.0, LASER.sigma, LASER.beams)
        yield at, scanner.scan(ranges, number * SCAN_DISTANCE / SPEED)


def building_rows(variants: Sequence[str], side: float, track: ProgressTracker) -> list[Result]:
    """One row per kind of map and sensor model, by the first of the variants that has it."""
    place = building(side)
    return [survey(variant, place, track) for variant in different(variants)]


def different(variants: Sequence[str]) -> list[str]:
    """The variants that have a map, without those whose map and sensor model came before."""
    kinds: dict[str, str] = {}
    for variant in variants:
        robot = slam.make(variant)
        if isinstance(robot, MaximumLikelihood):
            parts = configuration(robot.map_model), type(robot.sensor_model).__name__
            kinds.setdefault(json.dumps(parts), variant)
    return list(kinds.values())


def survey(variant: str, place: Building, track: ProgressTracker) -> Result:
    """Map the building at the true poses; MB of the map alone, and with its sensor model's layers.

    The sensor model is refreshed once, at the end, when its layers are largest. Peaks are growth of
    the whole process.
    """
    _mapped(variant, building(BAND_WIDTH), _untracked)  # compile first, which takes memory, too
    before = resident_mb()
    forget_peak()
    robot, changed = _mapped(variant, place, track)
    alone, peak_alone = map_memory(robot.map_model), peak_mb() - before
    robot.sensor_model.refresh(robot.map_model, changed)
    layered, map_model = map_memory(robot.map_model), robot.map_model
    side = float(np.ptp(place.walls[:, 0]))
    return {
        "what": variant,
        "side": side,
        "resolution": map_model.cells.tiles.resolution,
        "scans": len(place.poses),
        "observed": alone.observed * map_model.cells.tiles.resolution**2 / side**2,
        "map_mb": alone.nbytes / 1e6,
        "map_peak_mb": peak_alone,
        "read_mb": layered.nbytes / 1e6,
        "read_peak_mb": peak_mb() - before,
    }


def _mapped(
    variant: str, place: Building, track: ProgressTracker
) -> tuple[MaximumLikelihood, np.ndarray]:
    """The SLAM with the building in its map, and the cells changed by the last scan."""
    robot = slam.make(variant)
    assert isinstance(robot, MaximumLikelihood)
    views, changed = scans(place), np.empty(0, dtype=np.int64)
    for _ in track(range(len(place.poses)), f"building, {variant}"):
        pose, scan = next(views)
        changed = robot.map_model.integrate(scan, pose)
    return robot, changed


def _untracked(items: Sequence[T], description: str) -> Sequence[T]:
    """A `ProgressTracker` that shows nothing."""
    return items


def building_table(rows: list[Result]) -> Table:
    """The table for a terminal; sizes above MAX_MAP_MB are marked."""
    table = Table(box=HORIZONTALS, title=_title(rows))
    table.caption, table.caption_justify = COLUMN_LEGEND, "left"
    table.add_column("what", no_wrap=True)
    for heading in ("seen", "map, MB", "peak", "with layers, MB", "peak"):
        table.add_column(heading, justify="right")
    for row in rows:
        sizes = (row[key] for key in ("map_mb", "map_peak_mb", "read_mb", "read_peak_mb"))
        marked = (f"{size:.0f}{' !' if size > MAX_MAP_MB else ''}" for size in sizes)
        table.add_row(row["what"], f"{row['observed']:.1%}", *marked)
    return table


COLUMN_LEGEND = (
    "Mapped at the true poses, all rooms and corridors. MB of the map alone, and with the layers "
    "of its sensor model; peak: largest growth of the process (0: not reported by the system); "
    f"!: above {MAX_MAP_MB:.0f} MB"
)


def _title(rows: list[Result]) -> str:
    if not rows:
        return "no variant with a map to show"
    side, resolution = rows[0]["side"], rows[0]["resolution"]
    return f"a building of {side:.0f} x {side:.0f} m in cells of {resolution:g} m"


def _along(corners: Array) -> Array:
    """(n, 3) poses every SCAN_DISTANCE along a polyline (p, 2), heading along it."""
    poses = []
    for start, stop in pairwise(corners):
        dx, dy = stop - start
        steps = max(math.ceil(math.hypot(dx, dy) / SCAN_DISTANCE), 1)
        for t in np.arange(steps) / steps:
            poses.append((start[0] + t * dx, start[1] + t * dy, math.atan2(dy, dx)))
    return np.array(poses)
