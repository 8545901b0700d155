import math

import numpy as np

from slam.algorithms.maximum_likelihood import MaximumLikelihood
from slam.algorithms.pose_covariance import MapUncertainty, carried, fused, of_motion
from slam.geometry import Pose2, turned
from slam.maps.tiles import AREA, Tiles
from slam.motion.gaussian import Prediction, odometry_covariance
from slam.scan import Scan

SOME = np.diag([0.01, 0.02, 0.001])
ANGLES = np.linspace(-np.pi / 2, np.pi / 2, 91)


def exact(x: float, y: float) -> Prediction:
    """A prediction without an error."""
    return Prediction(Pose2(), Pose2(x, y, 0.0), np.zeros(3))


def test_a_lever_turns_an_error_of_the_heading_into_one_of_the_place() -> None:
    drawn = np.random.default_rng(0).multivariate_normal(np.zeros(3), SOME, 200_000)
    ends = drawn + np.column_stack([-2.0 * drawn[:, 2], 3.0 * drawn[:, 2], np.zeros(len(drawn))])
    np.testing.assert_allclose(carried(SOME, exact(3.0, 2.0)), np.cov(ends.T), atol=2e-4)


def test_errors_of_the_odometry_are_added() -> None:
    prediction = Prediction(Pose2(1.0, 2.0, 0.5), Pose2(0.3, 0.0, 0.1), np.array([0.1, 0.2, 0.3]))
    moved = exact(0.3 * math.cos(0.5), 0.3 * math.sin(0.5))
    added = carried(SOME, prediction) - carried(SOME, moved)
    np.testing.assert_allclose(added, odometry_covariance(*prediction.gaussian), atol=1e-12)


def test_a_motion_is_seen_from_its_begin() -> None:
    prediction = Prediction(Pose2(1.0, 2.0, 0.5), Pose2(0.3, 0.0, 0.1), np.array([0.1, 0.2, 0.3]))
    information, turn = np.diag([400.0, 100.0, 5000.0]), turned(-0.5)
    world = np.linalg.inv(np.linalg.inv(odometry_covariance(*prediction.gaussian)) + information)
    found = of_motion(prediction, information, 0.5)
    np.testing.assert_allclose(found, turn @ world @ turn.T)


def test_in_an_exact_map_a_match_is_bayes_rule() -> None:
    information = np.diag([400.0, 100.0, 5000.0])
    expected = np.linalg.inv(np.linalg.inv(SOME) + information)
    np.testing.assert_allclose(fused(SOME, np.zeros((3, 3)), information), expected)


def test_no_match_makes_a_pose_surer_than_the_map_is() -> None:
    ground = SOME / 2
    found = fused(SOME, ground, 1e9 * np.eye(3))
    np.testing.assert_allclose(found, ground, atol=1e-8)


def test_a_scan_that_says_nothing_leaves_the_prediction() -> None:
    np.testing.assert_allclose(fused(SOME, SOME / 3, np.zeros((3, 3))), SOME, atol=1e-12)


ORIGIN = Pose2(1.0, 1.0, 0.0)
NEAR, FAR = np.array([[0.5, 0.5]]), np.array([[4.0, 4.0]])  # echoes in the first and second tile


def two_tiles() -> tuple[Tiles, MapUncertainty]:
    """Tiles with echoes of a keyframe each, at (1, 1) and (2, 1) m."""
    tiles = Tiles(0.05)
    ground = MapUncertainty(tiles)
    tiles.extend((0.0, 0.0), (10.0, 10.0))
    tiles.index[0, 0] = 1
    tiles.allocate(2)
    ground.settle(ORIGIN, SOME, NEAR)
    tiles.index[1, 1] = 2
    tiles.allocate(3)
    ground.settle(Pose2(2.0, 1.0, 0.0), 3 * SOME, FAR - (1.0, 0.0))
    return tiles, ground


def test_tiles_remember_who_drew_them() -> None:
    _, ground = two_tiles()
    np.testing.assert_allclose(ground.covariance(ORIGIN, NEAR), SOME)
    inherited = carried(3 * SOME, exact(-1.0, 0.0))
    np.testing.assert_allclose(ground.covariance(ORIGIN, FAR), inherited)
    both = ground.covariance(ORIGIN, np.vstack([NEAR, FAR]))
    np.testing.assert_allclose(both, (SOME + inherited) / 2)
    far = np.array([[100.0, 100.0], [7.0, 0.5]])
    assert not ground.covariance(ORIGIN, far).any()


def test_a_tile_inherits_the_mean_of_the_keyframes_with_echoes_in_it() -> None:
    _, ground = two_tiles()
    before = ground.covariance(ORIGIN, FAR)
    for covariance in (2 * SOME, 6 * SOME):
        ground.settle(ORIGIN, covariance, NEAR)
    np.testing.assert_allclose(ground.covariance(ORIGIN, NEAR), 3 * SOME)
    np.testing.assert_array_equal(ground.covariance(ORIGIN, FAR), before)


def test_a_tile_forgets_its_first_keyframes() -> None:
    _, ground = two_tiles()
    for _ in range(60):
        ground.settle(ORIGIN, 5 * SOME, NEAR)
    np.testing.assert_allclose(ground.covariance(ORIGIN, NEAR), 5 * SOME, rtol=0.01)


def test_a_copied_tile_keeps_its_covariance() -> None:
    tiles, ground = two_tiles()
    fork = tiles.fork()
    tiles.unshare(np.array([AREA]), np.array([False]), 0)
    ground.settle(ORIGIN, 3 * SOME, NEAR)
    np.testing.assert_allclose(ground.covariance(ORIGIN, NEAR), 2 * SOME)
    tiles.switch(fork)
    np.testing.assert_allclose(ground.covariance(ORIGIN, NEAR), SOME)


def corridor(x: float, ends: bool) -> Scan:
    """A passage along x, 2 m wide; with walls across at 0 and 30 m, or none within hearing."""
    with np.errstate(divide="ignore"):
        aside = 1.0 / np.abs(np.sin(ANGLES))
        ahead = (30.0 - x) / np.cos(ANGLES) if ends else np.full(len(ANGLES), np.inf)
    return Scan(np.minimum(aside, ahead), ANGLES, 40.0 if ends else 8.0, time=10.0 * x)


def spread(ends: bool, way: float) -> list[float]:
    slam = MaximumLikelihood(Pose2(1.0, 0.0, 0.0))
    slam.update(Pose2(), corridor(1.0, ends))
    result = []
    for k in range(1, round(way / 0.1)):
        estimate = slam.update(Pose2(0.1, 0.0, 0.0), corridor(1.0 + 0.1 * k, ends))
        result.append(math.sqrt(estimate.covariance[0, 0]))
        assert np.linalg.eigvalsh(estimate.covariance).min() >= 0.0
    return result


def test_along_a_featureless_corridor_the_covariance_grows() -> None:
    """Not at each step: sparse echoes on the walls tell of the way what is not there."""
    along = spread(ends=False, way=30.0)
    thirds = [float(np.mean(part)) for part in np.array_split(along, 3)]
    assert thirds[0] < thirds[1] < thirds[2]
    assert max(along) > 4 * along[0]
    bounded = spread(ends=True, way=25.0)
    assert thirds[2] > 1.5 * np.mean(bounded[-50:])
