"""The scores of a run against the truth of its episode."""

from __future__ import annotations

from slam.benchmark.run import Run
from slam.episode import Episode
from slam.metrics.episode_scorer import EpisodeScorer
from slam.metrics.json_scores import Number


def score(result: Run, episode: Episode) -> dict[str, Number | None]:
    """Trajectory and map scores by name: those of `TrajectoryScores`, `MapScores` (also with
    `_aligned` after their names) and `ChangeScores`; None for a score that is not finite.

    For several runs on one episode, an `EpisodeScorer` prepares the truth once. Raises InputError
    if the episode holds no truth.
    """
    scorer = EpisodeScorer(episode, result.grid.spec.resolution)
    return scorer.scores(result.poses, result.grid)
