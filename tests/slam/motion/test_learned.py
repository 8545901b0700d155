"""The motion model that learns the bias of the odometry's heading."""

import math

import numpy as np
import pytest

from slam.algorithms.maximum_likelihood import MaximumLikelihood
from slam.benchmark.run import run, true_start
from slam.errors import InputError
from slam.geometry import Pose2
from slam.motion.gaussian import GaussianMotion
from slam.motion.learned import LearnedOdometry
from tests.slam.worlds import PAPERS_BIAS, drive

EXACT = np.diag([1e-6, 1e-6, math.radians(0.1) ** 2])
STRAIGHT = Pose2(0.1)


def taught(model: LearnedOdometry, per_m=0.0, per_rad=0.0, keyframes=40, seed=0, noise=0.0):
    """Learn from true motions and odometry with a given bias."""
    rng = np.random.default_rng(seed)
    for _ in range(keyframes):
        true = Pose2(0.1, 0.0, rng.uniform(-0.2, 0.2))
        error = per_m * 0.1 + per_rad * true.theta
        told = Pose2(0.0, 0.0, error / 2) @ true @ Pose2(0.0, 0.0, error / 2)
        found = Pose2(true.x, true.y, true.theta + rng.normal(0, noise) if noise else true.theta)
        model.learn(told, found, EXACT)
    return model


def test_at_first_it_is_the_base() -> None:
    model, base = LearnedOdometry(), GaussianMotion()
    for motion in (Pose2(), STRAIGHT, Pose2(0.1, -0.2, 0.7)):
        assert model.corrected(motion) == motion
        deviations, expected = model.deviations(motion), base.deviations(motion)
        np.testing.assert_array_equal(deviations[:2], expected[:2])
        assert expected[2] <= deviations[2] <= 1.5 * expected[2]


@pytest.mark.parametrize("bias", [PAPERS_BIAS, -PAPERS_BIAS, 0.0, 0.1])
def test_a_bias_per_metre_is_learned(bias: float) -> None:
    model = taught(LearnedOdometry(), per_m=bias, noise=math.radians(0.1))
    moved = model.corrected(Pose2(0.1, 0.0, 0.1 * bias))
    assert moved.theta == pytest.approx(0.0, abs=math.radians(0.3))
    assert model.bias[0] == pytest.approx(-bias, abs=math.radians(8.0))


def test_a_bias_per_turn_is_learned_beside_it() -> None:
    model = taught(LearnedOdometry(), per_m=0.5, per_rad=0.05, keyframes=300)
    assert model.corrected(Pose2(0.0, 0.0, 1.05)).theta == pytest.approx(1.0, abs=0.02)
    assert model.corrected(Pose2(0.1, 0.0, 0.05)).theta == pytest.approx(0.0, abs=0.003)


def test_half_of_the_correction_turns_the_way() -> None:
    model = taught(LearnedOdometry(), per_m=PAPERS_BIAS)
    arc = Pose2(0.2 * math.cos(0.1), 0.2 * math.sin(0.1), 0.2 * PAPERS_BIAS)
    moved = model.corrected(arc)
    correction = moved.theta - arc.theta
    assert math.atan2(moved.y, moved.x) == pytest.approx(0.1 + correction / 2)
    assert math.hypot(moved.x, moved.y) == pytest.approx(0.2)


def test_doubt_shrinks_to_what_remains_and_no_further() -> None:
    model, base = LearnedOdometry(rest=0.3), GaussianMotion()
    widths = [model.deviations(STRAIGHT)[2]]
    for k in range(60):
        taught(model, per_m=0.4, keyframes=1, seed=k)
        widths.append(model.deviations(STRAIGHT)[2])
    assert widths[-1] < 0.5 * widths[0]
    assert (np.diff(widths) < 1e-3).all()
    remains = math.hypot(0.3 * 0.1 * base.rotation_per_m, base.rotation_floor)
    assert remains < widths[-1] < 1.3 * remains
    np.testing.assert_array_equal(model.deviations(STRAIGHT)[:2], base.deviations(STRAIGHT)[:2])


def test_a_bias_that_changes_is_followed() -> None:
    model = taught(LearnedOdometry(), per_m=0.6, keyframes=100)
    taught(model, per_m=-0.3, keyframes=100)
    assert model.bias[0] == pytest.approx(0.3, abs=0.06)


def test_what_no_scan_told_teaches_nothing() -> None:
    """Without information in the scan the prediction is found, with its own covariance."""
    model = taught(LearnedOdometry(), per_m=0.6, keyframes=20)
    bias, doubt = model.bias.copy(), model.bias_covariance.copy()
    for _ in range(50):
        blind = np.diag(model.deviations(STRAIGHT) ** 2)
        model.learn(STRAIGHT, model.corrected(STRAIGHT), blind)
    np.testing.assert_array_equal(model.bias, bias)
    assert (np.diag(model.bias_covariance) >= np.diag(doubt)).all()


def test_the_prediction_is_taken_out_of_what_was_found() -> None:
    """The pose found is half way between prediction and scan; the bias of the scan is learned."""
    model, other = LearnedOdometry(), LearnedOdometry()
    before = model.deviations(STRAIGHT)[2] ** 2
    half = np.diag([1e-4, 1e-4, before / 2])
    model.learn(STRAIGHT, Pose2(0.1, 0.0, 0.05), half)  # a scan as sure as the odometry said 0.1
    noise = before + other._remaining.deviations(STRAIGHT)[2] ** 2
    gain = other.bias_covariance[0, 0] * 0.1 / (other.bias_covariance[0, 0] * 0.01 + noise)
    assert model.bias[0] == pytest.approx(gain * 0.1, rel=0.05)


def test_standing_or_turning_on_the_spot_is_lived_with() -> None:
    model = LearnedOdometry()
    for motion in (Pose2(), Pose2(0.0, 0.0, 0.2), Pose2(0.0, 0.0, -3.1)):
        for _ in range(20):
            model.learn(motion, motion, EXACT)
    assert np.isfinite(model.bias).all()
    assert model.bias == pytest.approx([0.0, 0.0])
    assert (np.linalg.eigvalsh(model.bias_covariance) >= -1e-12).all()


def test_headings_are_compared_the_short_way() -> None:
    model = LearnedOdometry()
    told, found = Pose2(0.1, 0.0, math.pi - 0.01), Pose2(0.1, 0.0, -math.pi + 0.01)
    for _ in range(50):
        model.learn(told, found, EXACT)
    assert model.corrected(told).theta == pytest.approx(found.theta, abs=0.002)
    assert np.abs(model.bias).max() < 0.1


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"base": LearnedOdometry}, "base must be a GaussianMotion"),
        ({"rest": 1.5}, "rest must be a finite number from 0 to 1"),
        ({"rest": -0.1}, "rest"),
        ({"drift": 0.0}, "drift must be a finite number above 0"),
    ],
)
def test_what_makes_no_sense_is_refused(options, message: str) -> None:
    with pytest.raises(InputError, match=message):
        LearnedOdometry(**options)


def test_a_drive_teaches_the_papers_bias_and_is_followed_as_well() -> None:
    episode = drive()
    motion = LearnedOdometry()
    learned = run(MaximumLikelihood(true_start(episode), motion_model=motion), episode)
    plain = run(MaximumLikelihood(true_start(episode)), episode)
    assert episode.truth is not None
    errors = [np.hypot(*(done.poses - episode.truth.poses)[:, :2].T) for done in (learned, plain)]
    assert errors[0].max() < max(1.2 * errors[1].max(), 0.03)
    straight = Pose2(0.1, 0.0, 0.1 * PAPERS_BIAS)
    assert motion.corrected(straight).theta == pytest.approx(0.0, abs=math.radians(1.0))
    assert motion.deviations(straight)[2] < 0.6 * GaussianMotion().deviations(straight)[2]
