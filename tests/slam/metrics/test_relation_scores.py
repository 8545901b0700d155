import gzip
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slam.geometry import between, compose
from slam.metrics.relations import Relations, carried, score_relations
from slam.trajectory import Trajectory


def wander(n: int, seed: int) -> Trajectory:
    steps = np.random.default_rng(seed).normal(0.1, 0.1, (n, 3))
    return Trajectory(np.linspace(0, (n - 1) * 0.5, n), np.cumsum(steps, axis=0))


def some_relations(trajectory: Trajectory, seed: int) -> Relations:
    rng = np.random.default_rng(seed)
    i, j = rng.integers(0, len(trajectory), (2, 40))
    poses, times = trajectory.poses, trajectory.times
    return Relations(times[i], times[j], between(poses[i], poses[j]))


def test_the_truth_scores_zero_wherever_it_starts() -> None:
    odometry = wander(30, 0)
    elsewhere = Trajectory(odometry.times, compose([3.0, -2.0, 1.0], odometry.poses))
    scores = score_relations(some_relations(odometry, 1), elsewhere, odometry)
    assert scores.translation_mean == pytest.approx(0, abs=1e-9)
    assert scores.rotation_mean_deg == pytest.approx(0, abs=1e-9)
    assert (scores.relations, scores.left_out) == (40, 0)


@given(st.integers(0, 10_000))
def test_a_perfect_correction_is_perfect_between_scans_too(seed: int) -> None:
    odometry = wander(20, seed)
    correct = Trajectory(odometry.times, compose([1.0, 2.0, 0.5], odometry.poses))
    sparse = Trajectory(correct.times[2:-2:5], correct.poses[2:-2:5])
    times = np.random.default_rng(seed).uniform(odometry.times[0], odometry.times[-1], 15)
    found = carried(sparse, odometry, times)
    expected = compose((1.0, 2.0, 0.5), odometry.at(times))
    assert np.allclose(found[:, :2], expected[:, :2], atol=1e-9)
    assert np.allclose(np.exp(1j * found[:, 2]), np.exp(1j * expected[:, 2]), atol=1e-9)


def test_corrections_blend_between_two_scans() -> None:
    odometry = Trajectory(np.array([0.0, 1, 2]), np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]]))
    corrected = Trajectory(np.array([0.0, 2]), np.array([[0.0, 0, 0], [2, 0.4, 0]]))
    times = np.array([0.0, 0.5, 1.0, 2.0])
    assert carried(corrected, odometry, times) == pytest.approx(
        np.array([[0, 0, 0], [0.5, 0.1, 0], [1, 0.2, 0], [2, 0.4, 0]])
    )


def test_scores_by_hand_and_relations_outside_the_log_are_counted() -> None:
    poses = np.array([[0.0, 0, 0], [1.0, 0, 0], [2.0, 0, 0]])
    walk = Trajectory(np.array([10.0, 11, 12]), poses)
    relations = Relations(
        np.array([10.0, 10.0, 9.0]),
        np.array([11.0, 12.0, 12.0]),
        np.array([[1.0, 0.1, 0], [2.0, 0, math.radians(3)], [0.0, 0, 0]]),
    )
    scores = score_relations(relations, walk, walk)
    assert scores.translation_mean == pytest.approx(0.05)
    assert scores.translation_std == pytest.approx(0.05)
    assert scores.rotation_mean_deg == pytest.approx(1.5)
    assert (scores.relations, scores.left_out) == (2, 1)


def test_stamps_that_fit_several_odometry_lines_are_not_clear() -> None:
    poses = np.array([[0.0, 0, 0], [1.0, 0, 0], [2.0, 0, 0], [2.0, 0, 0]])
    walk = Trajectory(np.array([10.0, 11, 12, 12.001]), poses)
    relations = Relations(
        np.array([10.0, 10.0]), np.array([11.0, 12.0]), np.array([[1.0, 0.1, 0], [2.0, 0.3, 0]])
    )
    scores = score_relations(relations, walk, walk)
    assert (scores.relations, scores.clear) == (2, 1)
    assert scores.clear_translation_mean == pytest.approx(0.1)
    assert scores.translation_mean == pytest.approx(0.2)


def test_no_relation_inside_the_log_is_none_in_json() -> None:
    walk = wander(3, 0)
    far = Relations(np.array([99.0]), np.array([100.0]), np.zeros((1, 3)))
    scores = score_relations(far, walk, walk).as_dict()
    assert scores["translation_mean"] is None
    assert scores["left_out"] == 1
    assert (scores["clear"], scores["clear_translation_mean"]) == (0, None)


def test_raw_odometry_of_the_intel_log(shared_data: Path) -> None:
    stamps, poses = [], []
    with gzip.open(shared_data / "intel.log.gz", "rt") as lines:
        for line in lines:
            if line.startswith("ODOM"):
                words = line.split()
                stamps.append(float(words[7]))
                poses.append([float(word) for word in words[1:4]])
    odometry = Trajectory(np.array(stamps), np.array(poses))
    rows = np.loadtxt(shared_data / "intel.relations")
    relations = Relations(rows[:, 0], rows[:, 1], rows[:, [2, 3, 7]])
    scores = score_relations(relations, odometry, odometry)
    assert scores.relations == 2984
    assert scores.translation_mean == pytest.approx(7.39, abs=0.005)
    assert scores.translation_std == pytest.approx(14.34, abs=0.005)
    assert scores.rotation_mean_deg == pytest.approx(39.4, abs=0.05)
    assert scores.clear == 683
