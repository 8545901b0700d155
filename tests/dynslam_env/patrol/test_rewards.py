import math

import numpy as np
import pytest

from dynslam_env.patrol.patroller import Patroller
from dynslam_env.patrol.rewards import COVARIANCE_FLOOR, RewardTerms, RewardWeights, pose_bits
from slam import Estimate, InputError, Pose2

from .drawn import wall

GAINS = RewardTerms(information=10.0, freshness=4.0, pose=-2.0, distance=0.3, collision=0.5)


def estimate(covariance):
    return Estimate(Pose2(), covariance, 0.0, True)


def test_terms_are_gains_times_weights():
    terms = RewardWeights({"information": 0.5, "collision": -2.0}).terms(GAINS)
    assert terms == {"information": 5.0, "collision": -1.0}


def test_every_gain_is_paid_by_default():
    assert set(RewardWeights().weights) == set(RewardTerms._fields)
    assert (
        RewardWeights().terms(GAINS)["distance"] < 0 < RewardWeights().terms(GAINS)["information"]
    )


@pytest.mark.parametrize(
    ("weights", "message"),
    [
        (
            {"speed": 1.0},
            "a name in RewardWeights.weights must be one of 'information'",
        ),
        ({"pose": math.nan}, r"RewardWeights.weights\['pose'\] must be a finite number"),
        ({"pose": "much"}, r"RewardWeights.weights\['pose'\] must be a finite number"),
        ([1.0], "RewardWeights.weights must be a Mapping"),
    ],
)
def test_wrong_weights_are_refused(weights, message):
    with pytest.raises(InputError, match=message):
        RewardWeights(weights)


def test_weights_are_nobody_elses_to_change():
    mine = {"pose": 1.0}
    weights = RewardWeights(mine)
    mine["pose"] = 7.0
    assert weights.weights["pose"] == 1.0


def test_a_deviation_twice_as_large_is_a_bit():
    one = pose_bits(np.diag([4.0, 9.0, 1.0]))
    assert pose_bits(np.diag([16.0, 9.0, 1.0])) - one == pytest.approx(1.0, abs=1e-4)


def test_no_pose_is_surer_than_need_be():
    floor = math.log2(math.sqrt(np.linalg.det(COVARIANCE_FLOOR)))
    assert pose_bits(np.zeros((3, 3))) == pytest.approx(floor)
    assert pose_bits(np.zeros((3, 3))) - pose_bits(1e-12 * np.eye(3)) == pytest.approx(0, abs=1e-4)


def test_pose_bits_add_up_to_those_from_the_first_to_the_last():
    rng = np.random.default_rng(0)
    factors = rng.normal(0.0, 0.1, (8, 3, 3))
    covariances = factors @ factors.transpose(0, 2, 1)
    robot = Patroller(estimate(covariances[0]), wall(2.0))
    paid = []
    for k, covariance in enumerate(covariances[1:], 1):
        robot.look(estimate(covariance), wall(2.0, 0.2 * k))
        paid.append(robot.gains(0.2 * k).pose)
    assert min(paid) < 0 < max(paid)
    assert sum(paid) == pytest.approx(pose_bits(covariances[0]) - pose_bits(covariances[-1]))


def test_a_step_is_paid_once():
    robot = Patroller(estimate(np.eye(3)), wall(2.0))
    robot.move(Pose2(0.3, 0.4, 1.0), True)
    robot.move(Pose2(-0.5, 0.0, 0.0), False)
    robot.look(estimate(0.1 * np.eye(3)), wall(2.0, 0.2))
    first, second = robot.gains(0.2), robot.gains(0.2)
    assert first.distance == pytest.approx(1.0)
    assert first.collision == 0.5
    assert first.information > 1.0
    assert second == RewardTerms()
