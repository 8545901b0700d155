"""Map scores against the true surfaces now: precision, recall, F1, and ADNN in both directions.

From map to truth the distance of each occupied cell's centre to the true segments is exact; from
truth to map the visible surface is sampled every half cell. The truth is not rasterised, so the
scores are valid after any rigid alignment.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.spatial import KDTree

from slam.geometry import Array, Pose2, transform_points
from slam.grid import OccupancyGrid
from slam.kernel import kernel
from slam.metrics.json_scores import Number, json_scores
from slam.metrics.surface import TrueSurface

AS_IS = Pose2()
ROUNDING = 1e-9  # m: a cell exactly at the tolerance is within it


class MapScores(NamedTuple):
    """How well the occupied cells agree with the true surfaces at the last scan.

    precision_*        share of the occupied cells that lie within 5 or 10 cm of a true surface
    recall_*           share of the samples of the visible true surface (`TrueSurface.points`, one
                       at least every half cell) within 5 or 10 cm of an occupied cell
    f1_*               their harmonic mean; 0 if no cell is occupied or no surface was visible
    adnn_map_to_truth  m, average distance from an occupied cell to the nearest true surface
    adnn_truth_to_map  m, from the visible true surface to the nearest occupied cell
    occupied_cells     number of occupied cells

    Without occupied cells the precision, recall and F1 are 0 and both distances infinite.
    """

    precision_5cm: float
    recall_5cm: float
    f1_5cm: float
    precision_10cm: float
    recall_10cm: float
    f1_10cm: float
    adnn_map_to_truth: float
    adnn_truth_to_map: float
    occupied_cells: int

    def as_dict(self, suffix: str = "") -> dict[str, Number | None]:
        """Flat, for JSON, `suffix` after every name; an infinite distance is None."""
        return json_scores(self._asdict(), suffix)


class OccupiedCells:
    """The occupied cells of a map, ready to be compared with a surface in any alignment."""

    def __init__(self, grid: OccupancyGrid) -> None:
        cells = np.argwhere(grid.solid)
        self.centres: Array = grid.spec.centres(cells)
        self._tree = KDTree(self.centres) if len(cells) else None

    def score(self, surface: TrueSurface, world_from_map: Pose2 = AS_IS) -> MapScores:
        """Scores of the cells moved by `world_from_map`, for instance `trajectory.alignment`."""
        if self._tree is None:
            return MapScores(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, math.inf, math.inf, 0)
        moved = transform_points(world_from_map, self.centres)
        to_truth = distances(moved, surface.segments)
        to_map = np.empty(0)
        if len(surface.points):
            points = transform_points(world_from_map.inverse(), surface.points)
            to_map = np.asarray(self._tree.query(points)[0])
        return MapScores(
            *_f1(to_truth, to_map, 0.05),
            *_f1(to_truth, to_map, 0.10),
            adnn_map_to_truth=float(to_truth.mean()),
            adnn_truth_to_map=float(to_map.mean()) if len(to_map) else math.inf,
            occupied_cells=len(moved),
        )


def score_map(
    grid: OccupancyGrid,
    surface: TrueSurface,
    world_from_map: Pose2 = AS_IS,
) -> MapScores:
    """Scores of one map; for several alignments of it, use one `OccupiedCells`."""
    return OccupiedCells(grid).score(surface, world_from_map)


def distances(points: Array, segments: Array) -> Array:
    """(n,) m, from each of points (n, 2) to the nearest of segments (w, 4); inf if w = 0."""
    return _distances(np.ascontiguousarray(points), np.ascontiguousarray(segments))


def _f1(to_truth: Array, to_map: Array, tolerance: float) -> tuple[float, float, float]:
    precision = float((to_truth <= tolerance + ROUNDING).mean())
    recall = float((to_map <= tolerance + ROUNDING).mean()) if len(to_map) else 0.0
    both = precision + recall
    return precision, recall, 2 * precision * recall / both if both else 0.0


@kernel
def _distances(points, segments):
    result = np.empty(len(points))
    for i in range(len(points)):
        best = np.inf
        for k in range(len(segments)):
            ax, ay = points[i, 0] - segments[k, 0], points[i, 1] - segments[k, 1]
            dx, dy = segments[k, 2] - segments[k, 0], segments[k, 3] - segments[k, 1]
            length2 = dx * dx + dy * dy
            t = 0.0
            if length2 > 0.0:
                t = min(max((ax * dx + ay * dy) / length2, 0.0), 1.0)
            ex, ey = ax - t * dx, ay - t * dy
            best = min(best, ex * ex + ey * ey)
        result[i] = np.sqrt(best)
    return result
