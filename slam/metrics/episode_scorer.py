"""All scores of runs on one episode with a known truth, which is prepared once."""

from __future__ import annotations

from collections.abc import Sequence

from slam.episode import Episode
from slam.geometry import Array, Pose2
from slam.grid import OccupancyGrid, moved
from slam.metrics.change import Calibration, TrueOccupancy
from slam.metrics.json_scores import Number
from slam.metrics.lost import LostScores, score_lost
from slam.metrics.mapping import OccupiedCells
from slam.metrics.surface import visible_truth
from slam.metrics.trajectory import alignment, ate, score_trajectory


class EpisodeScorer:
    """Scores any number of runs on one episode."""

    def __init__(self, episode: Episode, resolution: float = 0.05) -> None:
        truth = episode.known_truth("a score")
        self._truth, self._times = truth.poses, episode.times
        self._surface = visible_truth(truth, episode.scans, resolution)
        self._occupancy = TrueOccupancy(truth, resolution)

    def scores(self, poses: Array, grid: OccupancyGrid) -> dict[str, Number | None]:
        """Flat scores of the estimated poses (n, 3), one a scan, and the map after the last scan.

        The map's scores come twice: in the world frame, and with `_aligned` after their names moved
        by the rigid motion that aligns the trajectory.
        """
        return {
            **score_trajectory(poses, self._truth).as_dict(),
            **self.map_scores(grid, alignment(poses, self._truth)),
        }

    def map_scores(
        self, grid: OccupancyGrid, aligned: Pose2, frame: Pose2 = Pose2()
    ) -> dict[str, Number | None]:
        """The scores of the map only.

        aligned  the rigid motion in the world that aligns the trajectory
        frame    pose of the map's frame in the world
        """
        cells = OccupiedCells(grid)
        return {
            **cells.score(self._surface, frame).as_dict(),
            **cells.score(self._surface, aligned @ frame).as_dict("_aligned"),
            **self._occupancy.score(moved(grid, frame)).as_dict(),
        }

    def ate(self, poses: Array) -> float:
        """ATE, m, of other poses (n, 3), such as the online estimates."""
        return ate(poses, self._truth)

    def lost(self, online: Array, lost: Array, revisions: Sequence[Array] = ()) -> LostScores:
        """How well `lost` (n,), one a scan, tells where the online poses (n, 3) are wrong; see
        `score_lost`."""
        return score_lost(self._times, online, self._truth, lost, revisions)

    def calibration(self, grid: OccupancyGrid) -> Calibration:
        """Calibration of the map's h against the true share of time that cells are occupied."""
        return self._occupancy.calibration(grid)
