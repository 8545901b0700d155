import json

import numpy as np
import pytest

from slam.episode import Episode, Truth
from slam.errors import InputError
from slam.geometry import Pose2
from slam.grid import OccupancyGrid
from slam.metrics.change import TrueOccupancy
from slam.metrics.episode_scorer import EpisodeScorer
from slam.scan import Scan
from slam.trajectory import Trajectory

WALLS = np.array([[-1.0, -1, 3, -1], [3, -1, 3, 1], [3, 1, -1, 1], [-1, 1, -1, -1]]) + 0.01


def episode() -> Episode:
    """A robot that turns on the spot in a room, with a laser that hits its walls exactly."""
    angles = np.linspace(-np.pi, np.pi, 721)
    sides = np.stack([np.cos(angles) / 3.01, np.cos(angles) / -0.99])
    sides = np.vstack([sides, np.sin(angles) / 1.01, np.sin(angles) / -0.99])
    poses = np.column_stack([np.zeros((3, 2)), [0.0, 0.1, 0.2]])
    scans = tuple(
        Scan(1 / sides.max(axis=0), angles, 8.0, time=float(i), mount=Pose2(0, 0, -pose[2]))
        for i, pose in enumerate(poses)
    )
    odometry = Trajectory(np.arange(3.0), poses)
    return Episode(scans, odometry, Truth(poses, WALLS, np.empty((3, 0, 4))))


def test_the_truth_itself_gets_full_marks_as_json() -> None:
    drive = episode()
    truth = TrueOccupancy(drive.truth)  # pyright: ignore[reportArgumentType]
    grid = OccupancyGrid(truth.spec, truth.now.astype(float), np.ones(truth.spec.shape, bool))
    scores = EpisodeScorer(drive).scores(drive.odometry.poses, grid)
    assert json.loads(json.dumps(scores)) == scores
    for name in ("f1_5cm", "f1_5cm_aligned", "recall_5cm", "precision_5cm"):
        assert scores[name] == 1, name
    for name in ("ate", "ate_aligned", "heading_max", "brier_now_all", "brier_share_all"):
        assert scores[name] == pytest.approx(0, abs=1e-12), name


def test_an_episode_without_truth_cannot_be_judged() -> None:
    drive = episode()
    with pytest.raises(InputError, match="truth"):
        EpisodeScorer(Episode(drive.scans, drive.odometry))
