"""Scores of another SLAM system's trajectory, and of its map if given."""

from __future__ import annotations

import numpy as np

from slam.episode import Episode
from slam.geometry import Array, Pose2, compose
from slam.grid import OccupancyGrid
from slam.metrics.episode_scorer import EpisodeScorer
from slam.metrics.json_scores import Number
from slam.metrics.reference import associated
from slam.metrics.trajectory import alignment, score_trajectory
from slam.trajectory import Trajectory
from slam.validation import one_of

STAMP_TOLERANCE = 0.01  # s from a scan's stamp; evo's `t_max_diff`
FRAMES = ("anchored", "world", "aligned")


def score_external(
    episode: Episode,
    trajectory: Trajectory,
    grid: OccupancyGrid | None = None,
    map_frame: Pose2 = Pose2(),
    frame: str = "anchored",
) -> dict[str, Number | None]:
    """The scores of `EpisodeScorer` at the scans that the trajectory covers; `scans`: their number.

    grid       the map, in the frame of the trajectory
    map_frame  pose of the frame of `grid` in the frame of the trajectory
    frame      how the trajectory's frame is placed in the world: `anchored`, its first pose is the
               true one, since SLAM systems have their own origin; `world`, it is the world frame;
               `aligned`, by the best fit (Umeyama 1991)

    Raises InputError for an episode without the truth, and if no stamps match.
    """
    one_of("frame", frame, FRAMES)
    true_poses = episode.known_truth("a score").poses
    truth, found = associated(Trajectory(episode.times, true_poses), trajectory, STAMP_TOLERANCE)
    world = _frame(frame, found, truth)
    poses = compose(np.array(world), found)
    scores: dict[str, Number | None] = {"scans": len(poses)}
    scores |= score_trajectory(poses, truth).as_dict()
    if grid is not None:
        scorer = EpisodeScorer(episode, grid.spec.resolution)
        scores |= scorer.map_scores(grid, alignment(poses, truth), world @ map_frame)
    return scores


def _frame(frame: str, found: Array, truth: Array) -> Pose2:
    """The trajectory's frame in the world."""
    if frame == "anchored":
        return Pose2.of(truth[0]) @ Pose2.of(found[0]).inverse()
    return alignment(found, truth) if frame == "aligned" else Pose2()
