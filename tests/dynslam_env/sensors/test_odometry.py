import math

import numpy as np
import pytest
from scipy import stats

from dynslam_env import Odometry
from dynslam_env.sensors.odometry import STEPS_PER_DRAW, NoiseStreams, take
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


def readings(odometry, moved, noise, start=(1.0, -2.0, 0.7)):
    """(n, 3) what wheels report of one true displacement from `start`, with noise (n, 3)."""
    n = len(noise)
    before = np.tile(start, (n, 1))
    after = np.tile(Pose2.of(start) @ moved, (n, 1))
    motions, observed = np.empty((n, 3)), np.empty((n, 3), dtype=np.float32)
    odometry.read(np.arange(n), before, after, noise, motions, observed)
    assert (observed == motions.astype(np.float32)).all()  # none of these steps is very long
    return motions


def reading(odometry, moved):
    return Pose2.of(readings(odometry, moved, np.zeros((1, 3)))[0])


@pytest.mark.parametrize("moved", MOTIONS)
def test_without_errors_the_truth(moved):
    assert reading(EXACT, moved) == pytest.approx(moved, abs=1e-12)


def test_every_robot_has_a_stream_of_its_own_and_takes_three_numbers_a_step():
    streams, taken, noise = NoiseStreams(3), [[], [], []], np.empty((3, 3))
    for i in range(3):
        streams.reset(i, np.random.default_rng(i))
    others = np.random.default_rng(9)
    for step in range(400):
        if step == 300:  # another episode of one of them
            streams.reset(1, np.random.default_rng(7))
            taken[1].clear()
        which = np.flatnonzero(others.random(3) < 0.6)
        take(which, streams.drawn, streams.taken, noise)
        for i in which.tolist():
            taken[i].append(noise[i].copy())
            if streams.taken[i] == STEPS_PER_DRAW:
                streams.draw(i)
    for seed, mine in zip((0, 7, 2), taken, strict=True):
        assert np.array_equal(mine, np.random.default_rng(seed).standard_normal((len(mine), 3)))
    assert len(taken[0]) > 200


def test_only_the_robots_that_are_named_are_read():
    motions, observed = np.full((4, 3), 9.0), np.full((4, 3), 9.0, dtype=np.float32)
    before, after, noise = np.random.default_rng(0).uniform(-0.1, 0.1, (3, 4, 3))
    Odometry().read(np.array([1, 3]), before, after, noise, motions, observed)
    assert (motions[[0, 2]] == 9.0).all()
    assert (observed[[0, 2]] == 9.0).all()
    assert (np.abs(motions[[1, 3]]) < 1.0).all()


def test_the_observed_motion_stays_within_its_box():
    motions, observed = np.empty((1, 3)), np.empty((1, 3), dtype=np.float32)
    after, noise = np.array([(7.0, -9.0, 2.0)]), np.zeros((1, 3))
    EXACT.read(np.zeros(1, dtype=np.int64), np.zeros((1, 3)), after, noise, motions, observed)
    assert motions[0] == pytest.approx([7.0, -9.0, 2.0])
    assert observed[0].tolist() == [1.0, -1.0, 2.0]


def test_the_paper_bias_bends_a_straight_drive_into_a_circle_of_95_cm():
    systematic, pose, poses = Odometry(**NONE), Pose2(), []
    for _ in range(400):
        pose = pose @ reading(systematic, Pose2(0.05, 0.0, 0.0))
        poses.append(pose)
    points = np.array(poses)[:, :2]
    centre = np.array([0.0, 0.95493])
    radii = np.hypot(*(points - centre).T)
    assert radii == pytest.approx(np.full(400, 0.955), abs=0.002)
    per_step = reading(systematic, Pose2(0.05, 0.0, 0.0)).theta
    assert math.degrees(per_step) == pytest.approx(3.0)


def test_backwards_the_bias_turns_the_same_way():
    backwards = reading(Odometry(**NONE), Pose2(-0.05, 0, 0))
    assert backwards.theta == pytest.approx(math.pi / 60)


def spread(moved, samples=20_000, **alphas):
    noise = np.random.default_rng(1).standard_normal((samples, 3))
    return readings(Odometry(bias=0.0, **(NONE | alphas)), moved, noise)


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
    drawn = spread(moved, **alphas)
    n = len(drawn)
    assert drawn[:, column].std() == pytest.approx(expected, rel=5 / math.sqrt(2 * n))
    errors = drawn[:, column] - moved[column]
    assert abs(errors.mean()) < 5 * expected / math.sqrt(n) + 1e-4  # a bent chord is shorter


def test_backwards_is_no_turn():
    assert spread(Pose2(-0.1, 0, 0), samples=100, alpha1=1.0, alpha4=1.0).std(0).max() < 1e-12


ARC = Pose2(0.08, 0.02, 0.5)  # turn, drive, turn: by 0.245, 0.0825, 0.255
ROT1, TRANS, ROT2 = math.atan2(0.02, 0.08), math.hypot(0.08, 0.02), 0.5 - math.atan2(0.02, 0.08)


def parts(drawn):
    """(3, n) turn, drive, turn that the readings consist of."""
    course = np.arctan2(drawn[:, 1], drawn[:, 0])
    return np.array([course, np.hypot(*drawn[:, :2].T), drawn[:, 2] - course])


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(
    ("alphas", "expected"),
    [
        ({"alpha1": 0.01}, (0.1 * ROT1, 0.0, 0.1 * ROT2)),
        ({"alpha2": 0.04}, (0.2 * TRANS, 0.0, 0.2 * TRANS)),
        ({"alpha3": 0.01}, (0.0, 0.1 * TRANS, 0.0)),
        ({"alpha4": 0.0004}, (0.0, 0.02 * math.hypot(ROT1, ROT2), 0.0)),
        (
            {"alpha1": 0.01, "alpha2": 0.04, "alpha3": 0.01, "alpha4": 0.0004},
            (
                math.hypot(0.1 * ROT1, 0.2 * TRANS),
                math.hypot(0.1 * TRANS, 0.02 * math.hypot(ROT1, ROT2)),
                math.hypot(0.1 * ROT2, 0.2 * TRANS),
            ),
        ),
    ],
    ids=["alpha1", "alpha2", "alpha3", "alpha4", "all"],
)
def test_each_part_of_a_motion_errs_with_its_own_variance(alphas, expected, sign):
    """Of an arc, forwards and backwards: means and variances of 20,000 readings, chi-square."""
    drawn = spread(Pose2(sign * ARC.x, sign * ARC.y, ARC.theta), **alphas)
    drawn[:, :2] *= sign
    errors = parts(drawn) - np.array([ROT1, TRANS, ROT2])[:, None]
    n = errors.shape[1]
    for error, deviation in zip(errors, expected, strict=True):
        assert abs(error.mean()) < 4 * deviation / math.sqrt(n) + 1e-12
        if deviation:
            assert 1e-5 < stats.chi2(n).cdf((error**2).sum() / deviation**2) < 1 - 1e-5
            assert stats.kstest(error / deviation, "norm").pvalue > 1e-4
        else:
            assert np.abs(error).max() < 1e-12
    correlations = np.corrcoef(errors[list(map(bool, expected))])
    assert np.abs(np.atleast_2d(correlations) - np.eye(len(np.atleast_2d(correlations)))).max() < (
        5 / math.sqrt(n)
    )


@pytest.mark.parametrize("bias", [math.pi / 3, -0.4, 0.0])
def test_the_bias_turns_by_the_way_travelled_and_errs_not_at_all(bias):
    systematic = Odometry(bias=bias, **NONE)
    for moved in (Pose2(0.1, 0.0, 0.0), Pose2(-0.1, 0.0, 0.2), ARC, Pose2(0.0, 0.0, 0.4)):
        way = math.hypot(moved.x, moved.y)
        drawn = readings(systematic, moved, np.random.default_rng(0).standard_normal((9, 3)))
        assert np.ptp(drawn, axis=0).max() == 0.0
        assert drawn[0, 2] == pytest.approx(moved.theta + bias * way)
        assert np.hypot(*drawn[0, :2]) == pytest.approx(way)
        turned = Pose2(0.0, 0.0, bias * way / 2) @ Pose2(moved.x, moved.y, 0.0)
        assert drawn[0, :2] == pytest.approx(np.array(turned)[:2])


@pytest.mark.parametrize("wrong", [{"bias": math.nan}, {"alpha2": -1.0}, {"alpha4": "much"}])
def test_wrong_parameters_are_refused(wrong):
    name = next(iter(wrong))
    with pytest.raises(InputError, match=rf"Odometry.{name} must be a finite number"):
        Odometry(**wrong)
