import math

import numpy as np
import pytest

from dynslam_env import Corridor, Laser
from dynslam_env.laser import Scanner
from slam import InputError, Pose2
from tests.dynslam_env import naive

SQUARE = np.array([(-2.0, -1, 3, -1), (3, -1, 3, 1), (3, 1, -2, 1), (-2, 1, -2, -1)])
EXACT = Laser(sigma=0.0)


def scanner(laser=EXACT, seed=0):
    return Scanner(laser, np.random.default_rng(seed))


def worlds():
    rng = np.random.default_rng(0)
    for seed in range(4):
        layout = Corridor().layout(np.random.default_rng(seed))
        leaves = [naive.leaf(d, d.closed + d.swing * rng.uniform(0, 1.5)) for d in layout.doors]
        segments = np.concatenate([layout.walls, *leaves])
        yield Pose2(rng.uniform(0.5, 11.5), rng.uniform(-0.9, 0.9), rng.uniform(-4, 4)), segments
    for _ in range(8):
        yield Pose2.of(rng.uniform(-3, 3, 3)), rng.uniform(-9, 9, (40, 4))


@pytest.mark.parametrize(("pose", "segments"), list(worlds()))
def test_ranges_agree_with_the_naive_reference(pose, segments):
    x, y, theta = pose
    expected = naive.cast(x, y, theta, EXACT.angles, segments, EXACT.max_range)
    ranges = scanner().exact(pose, segments)
    assert (np.isinf(ranges) == np.isinf(expected)).all()
    hit = np.isfinite(expected)
    assert np.abs(ranges[hit] - expected[hit]).max() < 1e-4


def test_a_room_by_hand():
    ranges = scanner(Laser(beams=5, sigma=0)).exact(Pose2(), SQUARE)
    assert ranges == pytest.approx([1, math.sqrt(2), 3, math.sqrt(2), 1])


def test_no_echo_beyond_the_range():
    ranges = scanner(Laser(beams=3, sigma=0, max_range=2.5)).exact(Pose2(), SQUARE)
    assert ranges.tolist() == [pytest.approx(1), math.inf, pytest.approx(1)]


def test_nothing_slips_through_where_two_walls_meet():
    turned = np.linspace(0, math.tau, 2000)
    laser = scanner(Laser(beams=361, sigma=0, field_of_view=math.tau, max_range=100))
    for theta in turned[::20]:
        assert np.isfinite(laser.exact(Pose2(0.3, 0.2, theta), SQUARE)).all()


def test_the_mount_moves_the_sensor():
    mounted = scanner(Laser(beams=1, sigma=0, mount=Pose2(0.5, 0.2, math.pi / 2)))
    assert mounted.exact(Pose2(1, 0, 0), SQUARE) == pytest.approx([0.8])


def test_noise_has_the_configured_deviation_and_no_bias():
    noisy, truth = scanner(Laser()), scanner().exact(Pose2(), SQUARE)
    errors = np.array([noisy.ranges(Pose2(), SQUARE) - truth for _ in range(200)])
    n = errors.size
    assert abs(errors.mean()) < 5 * 0.01 / math.sqrt(n)
    assert errors.std() == pytest.approx(0.01, abs=5 * 0.01 / math.sqrt(2 * n))


def test_dropouts_are_no_reading_at_all():
    dropping = scanner(Laser(dropout=0.2))
    ranges = np.array([dropping.ranges(Pose2(), SQUARE) for _ in range(100)])
    assert np.isnan(ranges).mean() == pytest.approx(0.2, abs=0.02)
    scan = dropping.scan(ranges[0], 0.0)
    assert not scan.hit[np.isnan(ranges[0])].any()
    observed = dropping.observed(ranges[0])
    assert (observed[np.isnan(ranges[0])] == 0).all()
    assert observed.dtype == np.float32


def test_a_reading_nearer_than_the_minimum_is_none_at_all():
    near = scanner(Laser(beams=3, sigma=0.0, min_range=0.5))
    ranges = near.ranges(Pose2(0.0, 0.7, 0.0), SQUARE)  # the wall on the left is 0.3 m away
    assert ranges == pytest.approx([1.7, 3.0, math.nan], nan_ok=True)
    assert near.observed(ranges) == pytest.approx([1.7, 3.0, 0.0])
    assert near.scan(ranges, 0.0).hit.tolist() == [True, True, False]


def test_noise_gives_no_reading_below_zero():
    noisy = scanner(Laser(sigma=2.0, min_range=0.0))
    ranges = noisy.ranges(Pose2(), SQUARE)
    assert np.isnan(ranges).any()
    assert noisy.observed(ranges).min() == 0.0


def test_no_echo_is_infinite_in_the_scan_and_the_range_in_the_observation():
    laser = scanner(Laser())
    ranges = laser.ranges(Pose2(), np.empty((0, 4)))
    assert laser.scan(ranges, 0.0).no_echo.all()
    assert (laser.observed(ranges) == 8.0).all()


@pytest.mark.parametrize(
    "wrong",
    [
        {"beams": 0},
        {"beams": 1.5},
        {"field_of_view": 7.0},
        {"sigma": -0.1},
        {"dropout": 1.1},
        {"max_range": math.inf},
        {"min_range": 9.0},
        {"mount": (0, 0, 0)},
    ],
)
def test_wrong_parameters_are_refused(wrong):
    with pytest.raises(InputError, match=f"Laser.*{next(iter(wrong))}"):
        Laser(**wrong)
