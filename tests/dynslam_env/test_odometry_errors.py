import math

import numpy as np
import pytest

from dynslam_env import Odometry
from slam import InputError, Pose2

NONE = {"alpha1": 0.0, "alpha2": 0.0, "alpha3": 0.0, "alpha4": 0.0}
EXACT = Odometry(bias=0.0, **NONE)
MOTIONS = [
    Pose2(0.05, 0.0, 0.0),
    Pose2(-0.05, 0.001, 0.02),
    Pose2(0.0, 0.0, 0.3),
    Pose2(1e-6, -1e-6, -0.2),
    Pose2(),
    Pose2(0.06, 0.01, 0.3),
]


def rng(seed=0):
    return np.random.default_rng(seed)


@pytest.mark.parametrize("moved", MOTIONS)
def test_without_errors_the_truth(moved):
    assert EXACT.reading(moved, rng()) == pytest.approx(moved, abs=1e-12)


@pytest.mark.parametrize("moved", MOTIONS)
def test_every_reading_draws_the_same_amount_of_noise(moved):
    used, fresh = rng(), rng()
    Odometry().reading(moved, used)
    fresh.standard_normal(3)
    assert used.random() == fresh.random()


def test_the_paper_bias_bends_a_straight_drive_into_a_circle_of_95_cm():
    systematic, noise, pose, poses = Odometry(**NONE), rng(), Pose2(), []
    for _ in range(400):
        pose = pose @ systematic.reading(Pose2(0.05, 0.0, 0.0), noise)
        poses.append(pose)
    points = np.array(poses)[:, :2]
    centre = np.array([0.0, 0.95493])
    radii = np.hypot(*(points - centre).T)
    assert radii == pytest.approx(np.full(400, 0.955), abs=0.002)
    per_step = systematic.reading(Pose2(0.05, 0.0, 0.0), noise).theta
    assert math.degrees(per_step) == pytest.approx(3.0)


def test_backwards_the_bias_turns_the_same_way():
    assert Odometry(**NONE).reading(Pose2(-0.05, 0, 0), rng()).theta == pytest.approx(math.pi / 60)


def spread(moved, samples=20_000, **alphas):
    odometry, noise = Odometry(bias=0.0, **(NONE | alphas)), rng(1)
    return np.array([odometry.reading(moved, noise) for _ in range(samples)])


@pytest.mark.parametrize(
    ("moved", "alphas", "column", "expected"),
    [
        (Pose2(0.1, 0, 0), {"alpha3": 0.01}, 0, 0.1 * 0.1),
        (Pose2(0, 0, 0.5), {"alpha1": 0.04}, 2, 0.2 * 0.5),
        (Pose2(1e-6, 1e-6, 0.5), {"alpha1": 0.04}, 2, 0.2 * 0.5),
        (Pose2(0, 0, 0.5), {"alpha4": 0.0004}, 0, 0.02 * 0.5),
        # both turns err, each by sqrt(alpha2) * trans
        (Pose2(0.1, 0, 0), {"alpha2": 0.01}, 2, math.sqrt(2) * 0.1 * 0.1),
        (Pose2(-0.1, 0, 0), {"alpha2": 0.01}, 2, math.sqrt(2) * 0.1 * 0.1),
    ],
)
def test_deviations_are_those_of_table_5_6(moved, alphas, column, expected):
    readings = spread(moved, **alphas)
    n = len(readings)
    assert readings[:, column].std() == pytest.approx(expected, rel=5 / math.sqrt(2 * n))
    errors = readings[:, column] - moved[column]
    assert abs(errors.mean()) < 5 * expected / math.sqrt(n) + 1e-4  # a bent chord is shorter


def test_backwards_is_no_turn():
    assert spread(Pose2(-0.1, 0, 0), samples=100, alpha1=1.0, alpha4=1.0).std(0).max() < 1e-12


@pytest.mark.parametrize("wrong", [{"bias": math.nan}, {"alpha2": -1.0}, {"alpha4": "much"}])
def test_wrong_parameters_are_refused(wrong):
    name = next(iter(wrong))
    with pytest.raises(InputError, match=rf"Odometry.{name} must be a finite number"):
        Odometry(**wrong)
