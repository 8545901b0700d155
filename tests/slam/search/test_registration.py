import math

import numpy as np
import pytest

from slam.errors import InputError
from slam.geometry import Pose2
from slam.interface import Posterior
from slam.maps.outline import outline
from slam.maps.static import Static
from slam.maps.surfaces import Surfaces
from slam.motion.gaussian import Prediction
from slam.search.gauss_newton import GaussNewton
from slam.search.registration import ECHO, PLANE, SPOT, EchoModel, Registration
from slam.sensor_models.endpoint import Endpoint
from tests.slam import naive
from tests.slam.worlds import FAN, ROOM, loop, scan_at

LOOSE = np.array([0.5, 0.5, 0.5])  # deviations that leave the pose to the scan
TRUTH = Pose2(0.35, 0.1, 0.8)
PASSAGE = np.array([[-4.0, -1.0, 12.0, -1.0], [-4.0, 1.0, 12.0, 1.0]])


def drawn(poses, walls=ROOM, angles=FAN, noise=0.0):
    """A map of the walls with its surfaces and its likelihood field."""
    rng = np.random.default_rng(3)
    grid, endpoint = Static(), Endpoint()
    surfaces = Surfaces(grid.cells.tiles)
    for pose in poses:
        scan = scan_at(Pose2.of(pose), angles=angles, walls=walls, rng=rng if noise else None)
        endpoint.refresh(grid, grid.integrate(scan, Pose2.of(pose)))
        surfaces.add(outline(scan.points), Pose2.of(pose))
    return grid, surfaces, endpoint


def registered(seen, surfaces, cells, guess, start, model=ECHO, **parameters):
    """Pose and information by a registration that takes every scan."""
    found = Registration(model, paired=0.01, **parameters)(seen, surfaces, cells, guess, start)
    assert found is not None
    return found


@pytest.fixture(scope="module")
def room():
    return drawn(loop(25), noise=0.005)


def prediction(pose: Pose2, deviations=LOOSE) -> Prediction:
    return Prediction(pose, Pose2(), deviations)


def moved(truth: Pose2, x: float, y: float, degrees: float) -> Pose2:
    return Pose2(truth.x + x, truth.y + y, truth.theta + math.radians(degrees))


@pytest.mark.parametrize(
    "error", [(0.02, 0.0, 0.0), (0.0, -0.02, 0.0), (-0.01, 0.015, 0.5), (0.01, 0.01, -0.7)]
)
def test_the_pose_is_found_to_a_millimetre(error, room) -> None:
    grid, surfaces, _ = room
    seen, start = outline(scan_at(TRUTH).points), moved(TRUTH, *error)
    pose, _ = registered(seen, surfaces, grid.cells, prediction(start), start)
    assert math.dist(pose[:2], TRUTH[:2]) < 0.002
    assert pose.theta == pytest.approx(TRUTH.theta, abs=math.radians(0.1))


def test_each_echo_is_compared_with_what_the_plain_search_finds(room) -> None:
    grid, surfaces, _ = room
    for pose in (TRUTH, moved(TRUTH, 0.01, -0.02, 1.0)):
        seen = outline(scan_at(TRUTH, angles=np.radians(np.arange(-120, 121, 1.0))).points)
        pairs = Registration().pairs(seen, surfaces, grid.cells, pose)
        expected = naive.pairs(seen, surfaces, grid.cells, pose, EchoModel())
        np.testing.assert_allclose(pairs, expected, atol=1e-9)
        assert {0.0, PLANE, SPOT} >= set(pairs[:, 0].tolist()) >= {PLANE}


def test_surfaces_beyond_the_border_of_a_tile_are_compared_too() -> None:
    side = 3.2  # of a tile: each wall lies on the border of two
    walls = np.array([[-side, -side, side, -side], [side, -side, side, side],
                      [side, side, -side, side], [-side, side, -side, -side]])  # fmt: skip
    grid, surfaces, _ = drawn(loop(9), walls=walls, noise=0.02)
    for pose in (Pose2(0.01, 0.02, 0.3), Pose2(-0.02, -0.01, 2.0)):
        seen = outline(scan_at(pose, walls=walls).points)
        pairs = Registration().pairs(seen, surfaces, grid.cells, pose)
        expected = naive.pairs(seen, surfaces, grid.cells, pose, EchoModel())
        np.testing.assert_allclose(pairs, expected, atol=1e-9)
        assert (pairs[:, 0] == PLANE).mean() > 0.5


def test_a_step_climbs_the_likelihood_of_the_pairs(room) -> None:
    """The information is the curvature of the mixture where echoes lie on their surfaces, and the
    pose where the gradient of the plain likelihood is zero."""
    grid, surfaces, _ = room
    seen = outline(scan_at(TRUTH).points)
    start = moved(TRUTH, 0.005, -0.004, 0.2)
    pose, information = registered(
        seen, surfaces, grid.cells, prediction(start), start, rounds=20, precision=1e-9
    )
    pairs = Registration().pairs(seen, surfaces, grid.cells, pose)

    def value(x: float, y: float, theta: float) -> float:
        away = -0.5 * (((np.array([x, y, theta]) - start) / LOOSE) ** 2).sum()
        return naive.registered(seen, pairs, Pose2(x, y, theta), EchoModel()) + float(away)

    steps = np.diag([1e-4, 1e-4, 1e-4])
    for step in steps:
        ahead, behind = value(*(np.array(pose) + step)), value(*(np.array(pose) - step))
        slope = (ahead - behind) / 2e-4
        assert abs(slope) < 0.02 * math.sqrt(information.max())
    assert (np.linalg.eigvalsh(information) > 0).all()


def test_a_wall_at_a_grazing_angle_does_not_draw_the_robot_along_itself() -> None:
    """In an endless passage each scan is drawn to the last one in the likelihood field, and to
    nothing here: the robot stays where the odometry leads."""
    angles = np.radians(np.arange(-90, 91, 1.0))
    grid, surfaces, endpoint = drawn([(0.0, 0.0, 0.0)], PASSAGE, angles)
    ahead = Pose2(0.05, 0.0, 0.0)
    scan = scan_at(ahead, angles=angles, walls=PASSAGE)
    guess = prediction(ahead, np.array([0.02, 0.02, 0.02]))
    drawn_back = GaussNewton(levels=1).climb(Posterior(endpoint, scan, guess), ahead)
    stays, information = registered(outline(scan.points), surfaces, grid.cells, guess, ahead)
    assert abs(drawn_back.x - ahead.x) > 0.002
    assert abs(stays.x - ahead.x) < 0.0005
    assert abs(stays.y) < 0.0005
    assert information[0, 0] < 1e-3 * information[1, 1]


def test_what_does_not_stand_any_more_has_no_effect(room) -> None:
    """h weighs surfaces: the same ones in free cells give a hundredth of the information."""
    grid, surfaces, _ = room
    seen = outline(scan_at(TRUTH).points)
    _, before = registered(seen, surfaces, grid.cells, prediction(TRUTH), TRUTH)
    kept = grid.cells.occupied.flat.copy()
    grid.cells.occupied.flat[:] = 0.0
    _, after = registered(seen, surfaces, grid.cells, prediction(TRUTH), TRUTH)
    grid.cells.occupied.flat[:] = kept
    assert after[0, 0] < 0.15 * before[0, 0]


def test_surfaces_of_few_echoes_count_less(room) -> None:
    grid, surfaces, _ = room
    seen = outline(scan_at(TRUTH).points)
    _, known = registered(seen, surfaces, grid.cells, prediction(TRUTH), TRUTH)
    guess, shy = prediction(TRUTH), EchoModel(new=300.0)
    _, unknown = registered(seen, surfaces, grid.cells, guess, TRUTH, shy)
    assert unknown[0, 0] < 0.3 * known[0, 0]


def test_without_surfaces_nothing_is_told() -> None:
    grid = Static()
    surfaces = Surfaces(grid.cells.tiles)
    grid.integrate(scan_at(TRUTH), TRUTH)
    seen = outline(scan_at(TRUTH).points)
    assert Registration()(seen, surfaces, grid.cells, prediction(TRUTH), TRUTH) is None


def test_a_scan_of_which_the_map_knows_too_little_is_left_as_it_is(room) -> None:
    grid, surfaces, _ = room
    seen = outline(scan_at(TRUTH).points)
    share = (Registration().pairs(seen, surfaces, grid.cells, TRUTH)[:, 0] == PLANE).mean()
    for paired, told in ((share - 0.02, True), (share + 0.02, False)):
        found = Registration(paired=paired)(seen, surfaces, grid.cells, prediction(TRUTH), TRUTH)
        assert (found is not None) == told


def test_a_pose_too_far_from_the_start_is_not_taken(room) -> None:
    grid, surfaces, _ = room
    start = moved(TRUTH, 0.02, 0.0, 0.0)
    seen = outline(scan_at(TRUTH).points)
    near = Registration(farthest=0.01, paired=0.3)
    assert near(seen, surfaces, grid.cells, prediction(start), start) is None


@pytest.mark.parametrize("wrong", [{"sigma": 0.0}, {"z_rand": -1.0}, {"new": math.inf}])
def test_wrong_parameters_of_the_model_are_refused(wrong) -> None:
    with pytest.raises(InputError, match=f"EchoModel.{next(iter(wrong))}"):
        Registration(EchoModel(**wrong))


@pytest.mark.parametrize("wrong", [{"rounds": 0}, {"steps": 0}, {"farthest": 0.0}])
def test_wrong_parameters_are_refused(wrong) -> None:
    with pytest.raises(InputError, match=f"Registration.{next(iter(wrong))}"):
        Registration(**wrong)
