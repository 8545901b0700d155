"""What is scored of a run: against the truth of a simulation, or what is known of a real log."""

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
from slam.metrics.episode_scorer import EpisodeScorer
from slam.metrics.reference import score_reference
from slam.metrics.relations import score_relations
from slam.trajectory import Trajectory

from .sources import LogFile, Source

PARTS = 50  # of an episode's time, that the error is told for
Scorer = Callable[[Run], dict[str, Any]]


def scorer(source: Source, episode: Episode) -> Scorer:
    """Scores any number of runs on one episode; what the truth gives is made once."""
    if episode.truth is not None:
        return TruthScorer(episode)
    return LogScorer(source, episode)


class TruthScorer:
    """Every score of `EpisodeScorer`; the online trajectory's ATE; the bound of the episode.

    error_curve  m, RMS of the position's error in each of PARTS equal parts of the scans
    calibration  how often cells that h is said of are occupied: see `slam.metrics.change`
    """

    def __init__(self, episode: Episode):
        self._episode = episode
        self._judges: dict[float, EpisodeScorer] = {}
        self._bound = _bound(episode)

    def __call__(self, run: Run) -> dict[str, Any]:
        """Flat scores, and the two series."""
        truth = self._episode.truth
        assert truth is not None
        resolution = run.grid.spec.resolution
        if resolution not in self._judges:
            self._judges[resolution] = EpisodeScorer(self._episode, resolution)
        judge = self._judges[resolution]
        errors = np.hypot(*(run.poses - truth.poses)[:, :2].T)
        return {
            **judge.scores(run.poses, run.grid),
            "ate_online": judge.ate(run.online),
            "ate_bound": self._bound,
            "error_curve": error_curve(errors),
            "calibration": judge.calibration(run.grid).as_dict(),
        }


class LogScorer:
    """The relations and the reference trajectory that lie beside a log, under its name.

    NAME.relations  true displacements between poses (Kuemmerle et al. 2009)
    NAME.tum        where the robot was, in the TUM format, in a frame of its own
    """

    def __init__(self, source: Source, episode: Episode):
        self._episode = episode
        self._relations = self._reference = None
        if isinstance(source, LogFile):
            beside = source.path.with_name(stem(source.path.name))
            relations, reference = (beside.with_name(beside.name + s) for s in KNOWN)
            self._relations = read_relations(relations) if relations.exists() else None
            self._reference = read_tum(reference) if reference.exists() else None

    def __call__(self, run: Run) -> dict[str, Any]:
        """The scores that what is known allows; none without."""
        scores: dict[str, Any] = {}
        for poses, tail in ((run.poses, ""), (run.online, "_online")):
            done = Trajectory(self._episode.times, poses)
            if self._relations is not None:
                found = score_relations(self._relations, done, self._episode.odometry)
                scores |= found.as_dict(tail)
            if self._reference is not None:
                scores |= score_reference(self._reference, done).as_dict(tail)
        return scores


KNOWN = (".relations", ".tum")
ENDINGS = (".log.gz", ".log", ".clf.gz", ".clf", ".npz")


def stem(name: str) -> str:
    """The name of a log without its ending; the same name where it is no log."""
    return next((name.removesuffix(end) for end in ENDINGS if name.endswith(end)), name)


def error_curve(errors: np.ndarray) -> list[float]:
    """RMS of the errors (n,) in each of PARTS equal parts; fewer of a shorter series."""
    parts = np.array_split(errors, min(PARTS, len(errors)))
    return [float(np.sqrt((part**2).mean())) for part in parts]


def _bound(episode: Episode) -> float | None:
    """RMS over the scans of `position_bounds`, m; None where it cannot be had or is infinite."""
    try:
        bound = float(np.sqrt((position_bounds(episode) ** 2).mean()))
    except InputError:  # not recorded by us, or a laser without noise
        return None
    return bound if math.isfinite(bound) else None
