"""A heading that is so wrong that no search follows it is corrected once that is certain."""

import math
from dataclasses import replace

import numpy as np
import pytest

from agents import record_path
from dynslam_env import Odometry
from slam import make
from slam.benchmark.run import run, true_start
from slam.episode import Episode
from slam.geometry import Pose2
from slam.metrics.trajectory import ate
from slam.motion.adaptive import AdaptiveOdometry

KNOWN = np.diag([0.01, 0.01, math.radians(0.5)]) ** 2
PAPER = math.radians(60.0)  # rad/m: 3 degrees per 5 cm


def taught(bias: float, steps: int, step: float = 0.2) -> AdaptiveOdometry:
    """A model that was taught that the odometry turns too little by `bias`, rad/m."""
    model, rng = AdaptiveOdometry(), np.random.default_rng(0)
    for _ in range(steps):
        turn = bias * step + rng.normal(0.0, math.radians(0.5))
        half = Pose2(0.0, 0.0, 0.5 * turn)
        model.learn(Pose2(step, 0.0, 0.0), half @ Pose2(step, 0.0, 0.0) @ half, KNOWN)
    return model


@pytest.mark.parametrize("factor", [-3.0, 2.0])
def test_a_large_bias_is_corrected_once_it_is_certain(factor: float) -> None:
    drive, half = Pose2(0.5, 0.0, 0.1), Pose2(0.0, 0.0, 0.25 * factor * PAPER)
    model = taught(factor * PAPER, 40)
    assert model.corrected(drive) == pytest.approx(half @ drive @ half, abs=0.03)
    assert model.systematic.scale.factor == 1.0  # nor are its distances taken to be wrong
    assert taught(factor * PAPER, 1).corrected(drive) == drive


def test_the_papers_bias_is_left_to_the_search() -> None:
    drive = Pose2(0.5, 0.0, 0.1)
    assert taught(PAPER, 100).corrected(drive) == drive


@pytest.mark.parametrize("slip", [45.0, 90.0])
def test_wheels_that_slip_once_are_no_bias(slip: float) -> None:
    model = taught(0.0, 3)
    model.learn(Pose2(0.1, 0.0, 0.0), Pose2(0.1, 0.0, math.radians(slip)), KNOWN)
    assert model.systematic.bias.correction == 0.0


def sparse(bias: float, every: int) -> Episode:
    """The corridor with moving doors, of which every n-th scan is left."""
    episode = record_path("DoorCorridor-v0", 5000, odometry=Odometry(bias=bias))
    truth = episode.known_truth("this test")
    left = replace(truth, poses=truth.poses[::every])
    return replace(episode, scans=episode.scans[::every], truth=left)


@pytest.mark.parametrize("variant", ["static-ml", "dynamic-graph"])
@pytest.mark.parametrize(("factor", "every"), [(3.0, 10), (2.0, 20)])
def test_a_robot_whose_odometry_turns_by_half_a_turn_between_scans(
    variant: str, factor: float, every: int
) -> None:
    """Without it, it is lost, and does not say so."""
    episode = sparse(factor * PAPER, every)
    found = run(make(variant, true_start(episode)), episode)
    assert ate(found.poses, episode.known_truth("this test").poses) < 0.3
