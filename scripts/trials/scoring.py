"""Scores of a run: against the truth of a simulation, or the reference of a recording."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from dynslam_env.simulation.pose_bounds import position_bounds
from slam.benchmark.run import Run
from slam.episode import Episode
from slam.errors import InputError
from slam.io.relations import read_relations
from slam.io.tum import read_tum
from slam.metrics.agreement import agreement
from slam.metrics.episode_scorer import EpisodeScorer
from slam.metrics.json_scores import json_scores
from slam.metrics.reference import score_reference
from slam.metrics.relations import score_relations
from slam.trajectory import Trajectory

from .sources import LogFile, Source

CURVE_PARTS = 50  # of the scans of an episode, in the error curve
Scorer = Callable[[Run], dict[str, Any]]


def scorer(source: Source, episode: Episode) -> Scorer:
    """A scorer of runs on one episode, which computes what depends on the truth only once."""
    if episode.truth is not None:
        return TruthScorer(episode)
    return LogScorer(source, episode)


class TruthScorer:
    """Scores of `EpisodeScorer`, ATE of the online trajectory, Cramer-Rao bound of the episode.

    error_curve  RMS position error, m, in each of CURVE_PARTS equal parts of the scans
    calibration  share of time that cells of a given h are occupied: see `slam.metrics.change`
    lost         whether the SLAM told that it was lost: see `slam.metrics.lost`
    """

    def __init__(self, episode: Episode):
        self._episode = episode
        self._scorers: dict[float, EpisodeScorer] = {}
        self._bound = _bound(episode)

    def __call__(self, run: Run) -> dict[str, Any]:
        """Flat scores, `error_curve`, `calibration` and `lost`."""
        truth = self._episode.truth
        assert truth is not None
        resolution = run.grid.spec.resolution
        if resolution not in self._scorers:
            self._scorers[resolution] = EpisodeScorer(self._episode, resolution)
        scorer = self._scorers[resolution]
        errors = np.hypot(*(run.poses - truth.poses)[:, :2].T)
        return {
            **scorer.scores(run.poses, run.grid),
            "ate_online": scorer.ate(run.online),
            "ate_bound": self._bound,
            "error_curve": error_curve(errors),
            "calibration": scorer.calibration(run.grid).as_dict(),
            "lost": scorer.lost(run.online, run.lost, run.revisions).as_dict(),
        }


class LogScorer:
    """Agreement of the walls, and scores by relations and a reference trajectory in files beside a
    log.

    NAME.relations  true displacements between poses (Kuemmerle et al. 2009)
    NAME.tum        reference trajectory in the TUM format, in a frame of its own
    """

    def __init__(self, source: Source, episode: Episode):
        self._episode = episode
        self._relations = self._reference = None
        if isinstance(source, LogFile):
            beside = source.path.with_name(stem(source.path.name))
            relations, reference = (beside.with_name(beside.name + s) for s in REFERENCE_ENDINGS)
            self._relations = read_relations(relations) if relations.exists() else None
            self._reference = read_tum(reference) if reference.exists() else None

    def __call__(self, run: Run) -> dict[str, Any]:
        """Flat scores; without such files, the agreement alone."""
        scores: dict[str, Any] = json_scores({"agreement": agreement(self._episode, run.poses)})
        for poses, tail in ((run.poses, ""), (run.online, "_online")):
            done = Trajectory(self._episode.times, poses)
            if self._relations is not None:
                found = score_relations(self._relations, done, self._episode.odometry)
                scores |= found.as_dict(tail)
            if self._reference is not None:
                scores |= score_reference(self._reference, done).as_dict(tail)
        return scores


REFERENCE_ENDINGS = (".relations", ".tum")
LOG_ENDINGS = (".log.gz", ".log", ".clf.gz", ".clf", ".npz")


def stem(name: str) -> str:
    """The name of a log without its ending; other names unchanged."""
    return next((name.removesuffix(end) for end in LOG_ENDINGS if name.endswith(end)), name)


def error_curve(errors: np.ndarray) -> list[float]:
    """RMS of the errors (n,) in each of CURVE_PARTS equal parts; fewer of a shorter series."""
    parts = np.array_split(errors, min(CURVE_PARTS, len(errors)))
    return [float(np.sqrt((part**2).mean())) for part in parts]


def _bound(episode: Episode) -> float | None:
    """RMS over the scans of `position_bounds`, m; None if unavailable or infinite."""
    try:
        bound = float(np.sqrt((position_bounds(episode) ** 2).mean()))
    except InputError:  # not of our simulator, or a laser without noise
        return None
    return bound if math.isfinite(bound) else None
