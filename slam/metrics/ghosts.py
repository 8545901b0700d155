"""Ghosts: occupied cells of a map where no static surface is; and the recall of the walls.

A ghost is an occupied cell farther than 15 cm from every wall. That is three cells of 5 cm: it
exceeds the sum of a cell's half diagonal (3.5 cm), a good run's error (5 cm) and a wall's blur of
one cell, yet two thirds of a door leaf of 0.9 m between its jambs still count. The count alone
rewards an empty map, so the share of the walls in the map is reported beside it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.spatial import KDTree

from slam.episode import Episode
from slam.geometry import Array, Pose2, transform_points, wrap_angle
from slam.grid import OccupancyGrid
from slam.metrics.json_scores import Number, json_scores
from slam.metrics.mapping import distances
from slam.metrics.surface import SeenSurface

GHOST_DISTANCE = 0.15  # m from every wall: a ghost
MAX_ASIDE, MIN_BEYOND = 0.05, 0.1  # m: beam to point, and length of the beam beyond it
WALL_TOLERANCE, HIT_TOLERANCE = 0.10, 0.05  # m: wall so near to an occupied cell is in the map
HIT_DISTANCE = 0.03  # m from an echo, at the true pose: the wall there was hit


class GhostScores(NamedTuple):
    """The ghosts of one map.

    ghosts_per_m  ghost cells for every metre of wall that was seen
    ghost_cells   number of ghost cells
    wall_recall   share of the seen wall within 10 cm of an occupied cell; NaN if none was seen
    hit_recall    share of the wall that echoes hit within 5 cm of an occupied cell
    """

    ghosts_per_m: float
    ghost_cells: int
    wall_recall: float
    hit_recall: float

    def as_dict(self, suffix: str = "") -> dict[str, Number | None]:
        """Flat, for JSON; NaN is None."""
        return json_scores(self._asdict(), suffix)


class Ghosts:
    """Finds the ghosts in any number of maps of one episode.

    Walls are all static surfaces, furniture included. A surface counts as seen if an echo, at the
    true pose, ended in its cell or a neighbouring one. Raises InputError if the episode does not
    hold the truth.
    """

    def __init__(self, episode: Episode, resolution: float = 0.05) -> None:
        truth = episode.known_truth("a count of ghosts")
        self._walls = truth.walls
        seen = SeenSurface(self._walls, resolution)
        for scan, pose in zip(episode.scans, truth.poses.tolist(), strict=True):
            seen.see(scan, Pose2(*pose))
        self.points: Array = seen.now(np.empty((0, 4))).points
        poses = (Pose2(*pose) for pose in truth.poses.tolist())
        seen_from = zip(poses, (scan.points for scan in episode.scans), strict=True)
        echoes = np.concatenate([transform_points(*one) for one in seen_from])
        self._hit = KDTree(echoes).query(self.points)[0] <= HIT_DISTANCE
        spacing = resolution / 2  # of the points, at most
        self.metres = len(self.points) * spacing

    def centres(self, grid: OccupancyGrid, world_from_map: Pose2 = Pose2()) -> Array:
        """(n, 2) m, world: the centres of the ghost cells."""
        moved = _occupied(grid, world_from_map)
        return moved[distances(moved, self._walls) > GHOST_DISTANCE]

    def score(self, grid: OccupancyGrid, world_from_map: Pose2 = Pose2()) -> GhostScores:
        """Scores of a map moved by `world_from_map`, for instance `trajectory.alignment`."""
        ghosts = len(self.centres(grid, world_from_map))
        if not len(self.points):
            return GhostScores(math.inf if ghosts else 0.0, ghosts, math.nan, math.nan)
        moved = _occupied(grid, world_from_map)
        away = np.full(len(self.points), np.inf)
        if len(moved):
            away = KDTree(moved).query(self.points)[0]
        recall = float((away <= WALL_TOLERANCE).mean())
        return GhostScores(
            ghosts / self.metres, ghosts, recall, float((away[self._hit] <= HIT_TOLERANCE).mean())
        )


def _occupied(grid: OccupancyGrid, world_from_map: Pose2) -> Array:
    return transform_points(world_from_map, grid.spec.centres(np.argwhere(grid.solid)))


def seen_through(episode: Episode, points: Array) -> np.ndarray:
    """(n,) int: number of scans, at the true poses, with a beam that passes through each of the
    points (n, 2), m, world, and at least 10 cm beyond. A cell through which no beam passed cannot
    be cleared by its own evidence."""
    truth = episode.known_truth("a count of beams")
    counts = np.zeros(len(points), np.int64)
    for scan, pose in zip(episode.scans, truth.poses.tolist(), strict=True):
        x, y, theta = Pose2(*pose) @ scan.mount
        away = np.hypot(points[:, 0] - x, points[:, 1] - y)
        bearing = wrap_angle(np.arctan2(points[:, 1] - y, points[:, 0] - x) - theta)
        beam = np.abs(wrap_angle(bearing[:, None] - scan.angles)).argmin(axis=1)
        aside = away * np.abs(wrap_angle(bearing - scan.angles[beam]))
        reached = np.where(scan.no_echo[beam], scan.max_range, scan.ranges[beam])
        with np.errstate(invalid="ignore"):  # NaN: no reading, compares False
            counts += (aside < MAX_ASIDE) & (reached > away + MIN_BEYOND)
    return counts
