"""Every score of a run on an episode with a known truth; what the truth gives is made once."""

from __future__ import annotations

from slam.episode import Episode
from slam.errors import InputError
from slam.geometry import Array
from slam.grid import OccupancyGrid
from slam.metrics.change import TrueOccupancy
from slam.metrics.flat import Number
from slam.metrics.mapping import OccupiedCells
from slam.metrics.surface import visible_truth
from slam.metrics.trajectory import alignment, ate, score_trajectory


class Judge:
    """Scores any number of runs on one episode."""

    def __init__(self, episode: Episode, resolution: float = 0.05) -> None:
        if episode.truth is None:
            raise InputError("scores against the truth need an episode that holds it")
        self._truth = episode.truth.poses
        self._surface = visible_truth(episode.truth, episode.scans, resolution)
        self._occupancy = TrueOccupancy(episode.truth, resolution)

    def scores(self, poses: Array, grid: OccupancyGrid) -> dict[str, Number | None]:
        """Flat scores of the estimated poses (n, 3), one a scan, and the map after the last scan.

        The map's scores come twice: in the world frame, and with `_aligned` after their names moved
        by the rigid motion that aligns the trajectory.
        """
        cells = OccupiedCells(grid)
        moved = alignment(poses, self._truth)
        return {
            **score_trajectory(poses, self._truth).as_dict(),
            **cells.score(self._surface).as_dict(),
            **cells.score(self._surface, moved).as_dict("_aligned"),
            **self._occupancy.score(grid).as_dict(),
        }

    def ate(self, poses: Array) -> float:
        """That of other poses (n, 3), such as those believed on the way."""
        return ate(poses, self._truth)
