"""Drives and single beams for tests of all map models; values by cells of the lattice."""

from __future__ import annotations

import math

import numpy as np

from slam.geometry import Pose2
from slam.maps.clamped import Clamped
from slam.maps.filtered import Filtered
from slam.maps.histogram import Histogram
from slam.maps.hmm import HMM
from slam.maps.hybrid import Hybrid
from slam.maps.log_odds import Evidence
from slam.maps.mean import Mean
from slam.maps.rays import Rays
from slam.maps.recency import Recency
from slam.maps.static import Static
from slam.maps.temporal import Temporal
from slam.maps.tiles import AREA, TILE, Layer, Tiles
from tests.slam import naive
from tests.slam.worlds import ROOM, beam, loop, scan_at

MODELS = [Static, Clamped, Histogram, Mean, Temporal, Recency, HMM, Filtered, Hybrid]
RAYS = Rays(reach=3.0, no_echo_reach=1.0)
EVIDENCE = Evidence(hit=0.85, free=-0.4, prior=0.23)  # no sum of these lies on a border of bins
VALUES = {"hit": 0.85, "free": -0.4, "prior": 0.23}

# A robot in the cell (0, 0) of a 1 m grid looks along x at a door in the cell (0, 3); a wall
# stands behind it in (0, 6).
ROBOT, DOOR, WALL = Pose2(0.5, 0.5), (0, 3), (0, 6)
CLOSED, OPEN, HIDDEN = 3.0, 6.0, 1.0


def drive(n: int = 12, seed: int = 0, step: float = 1.3):
    """(scan, pose) of a drive in which some of the room's walls appear and disappear."""
    rng = np.random.default_rng(seed)
    result = []
    for k, pose in enumerate(loop(n)):
        walls = ROOM[rng.random(len(ROOM)) < 0.7]
        angles = np.sort(rng.uniform(-3, 3, 15))
        scan = scan_at(Pose2.of(pose), time=step * k, angles=angles, walls=walls)
        result.append((scan, Pose2.of(pose)))
    return result


def again(history, later: float):
    """The same scans once more, `later` s after the first time."""
    return history + [(scan_at(pose, time=later + scan.time), pose) for scan, pose in history[:4]]


def integrated(grid, history):
    for scan, pose in history:
        grid.integrate(scan, pose)
    return grid


def seen(history):
    """[(time, {cell: hit})], the input of the naive maps."""
    return [(s.time, naive.seen(s, p, 0.05, RAYS.reach, RAYS.no_echo_reach)) for s, p in history]


def id_of(tiles: Tiles, cell: tuple[int, int]) -> int:
    """The id of a cell of the lattice."""
    return tiles.cell(*at(tiles, cell))


def at(tiles: Tiles, cell: tuple[int, int]) -> tuple[int, int]:
    """Row and column in the grid of a cell of the lattice."""
    return cell[0] - tiles.row0, cell[1] - tiles.col0


def value(grid, layer: Layer, cell: tuple[int, int]):
    return layer.flat[id_of(grid.cells.tiles, cell)]


def h(grid, cell: tuple[int, int] = DOOR) -> float:
    return float(value(grid, grid.cells.occupied, cell))


def lattice(tiles: Tiles, ids: np.ndarray) -> list[tuple[int, int]]:
    """Cells of the lattice by their ids."""
    slots, within = np.divmod(np.asarray(ids), AREA)
    cells = tiles.places[slots] * TILE + np.column_stack(np.divmod(within, TILE))
    return [(r, c) for r, c in cells.tolist()]


def watched(grid, *readings: tuple[float, float]) -> list[float]:
    """h of the door's cell after each of the readings (time, range)."""
    result = []
    for time, length in readings:
        grid.integrate(beam(length, time), ROBOT)
        result.append(h(grid))
    return result


def readings(gaps_and_lengths) -> list[tuple[float, float]]:
    """(time, range) of [(s since the one before, range)]."""
    times = np.cumsum([gap for gap, _ in gaps_and_lengths]).tolist()
    return [(time, length) for time, (_, length) in zip(times, gaps_and_lengths, strict=True)]


def beams_seen(of: list[tuple[float, float]]):
    """[(time, {cell: hit})] of readings of the single beam."""
    result = []
    for time, length in of:
        end = math.floor(ROBOT.x + length)
        cells = {(0, col): False for col in range(end)}
        result.append((time, {**cells, (0, end): True}))
    return result


def scans_until(grid, length: float, begin: float, step: float, done) -> int:
    """The number of scans, `step` s apart from `begin` on, until `done(h of the door)`."""
    for n in range(1, 5000):
        if done(watched(grid, (begin + (n - 1) * step, length))[0]):
            return n
    raise AssertionError("never")
