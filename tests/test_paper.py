"""The paper's direction, on a few seeds where it holds (all of 30: see `dynslam demo`)."""

import numpy as np
import pytest

import slam
from agents import record_corridor
from slam.benchmark.run import run, true_start
from slam.metrics.episode_scorer import EpisodeScorer

SEEDS = (0, 1, 2, 3)


@pytest.fixture(scope="module")
def scores():
    """(variant, doors) -> score name -> one value a seed."""
    table: dict[tuple[str, str], list[dict]] = {}
    for seed in SEEDS:
        for doors in ("static", "moving"):
            episode = record_corridor(seed, doors)
            judge = EpisodeScorer(episode)
            for variant in ("static-ml/beta1", "dynamic-ml/beta1", "odometry"):
                done = run(slam.make(variant, true_start(episode), seed), episode)
                row = judge.scores(done.poses, done.grid)
                table.setdefault((variant, doors), []).append(row)

    def values(variant, doors, name):
        return np.array([row[name] for row in table[variant, doors]], dtype=float)

    return values


def test_moving_doors_harm_static_ml(scores):
    moving = scores("static-ml/beta1", "moving", "ate")
    assert np.median(moving - scores("static-ml/beta1", "static", "ate")) > 0


def test_the_dynamic_map_knows_how_often_doors_are_open(scores):
    static, dynamic = (
        scores(f"{kind}-ml/beta1", "moving", "brier_share_door") for kind in ("static", "dynamic")
    )
    assert (dynamic < static).all()
    assert np.median(static - dynamic) > 0.03


def test_both_find_their_way_where_the_odometry_does_not(scores):
    for variant in ("static-ml/beta1", "dynamic-ml/beta1"):
        assert scores(variant, "moving", "ate").max() < 0.1
    assert scores("odometry", "moving", "ate").min() > 5.0
