"""Keyframes in a room whose true poses are known."""

import math

import numpy as np
import pytest

from slam.errors import InputError
from slam.geometry import Pose2, between, compose, wrap_angle
from slam.graph.alignment import EVERY, FAR, Alignment, _compared
from slam.graph.echoes import Echoes, echoes_of
from slam.maps.static import Static
from slam.scan import Scan
from tests.slam.rings import WALLS, way
from tests.slam.worlds import FAN, ROOM, loop, scan_at

MODEL = 0.15, 0.04, 0.3  # m along, m across, likelihood of another surface


def drawn(scans, poses) -> Static:
    grid = Static()
    for scan, pose in zip(scans, poses, strict=True):
        grid.integrate(scan, Pose2.of(pose))
    return grid


def seen(scans, poses) -> Echoes:
    return echoes_of(scans, poses, drawn(scans, poses))


def disturbed(poses: np.ndarray, rng, metres: float, degrees: float) -> np.ndarray:
    """The poses with errors that are independent of each other, but for the first."""
    errors = rng.normal(0, 1, poses.shape) * (metres, metres, math.radians(degrees))
    errors[0] = 0.0
    return compose(poses, errors)


def largest(found, truth) -> tuple[float, float]:
    """RMS error of the positions, m, and of the headings, rad."""
    off = found - truth
    return float(np.sqrt((off[:, :2] ** 2).sum(1).mean())), float(
        np.sqrt((wrap_angle(off[:, 2]) ** 2).mean())
    )


@pytest.mark.parametrize("seed", range(3))
def test_errors_of_the_poses_are_removed(seed: int) -> None:
    rng, truth = np.random.default_rng(seed), loop(60)
    scans = [scan_at(Pose2.of(pose), rng=rng) for pose in truth]
    before = disturbed(truth, rng, 0.02, 0.7)
    after = Alignment(beta=0.3)(seen(scans, before), before)  # against the odometry
    np.testing.assert_array_equal(after[0], truth[0])
    (metres, turn), (least_metres, least_turn) = largest(before, truth), largest(after, truth)
    assert least_metres < 0.25 * metres
    assert least_turn < 0.3 * turn
    assert least_metres < 0.006


def test_drift_is_spread_over_the_way_when_a_place_is_seen_again() -> None:
    """Two rounds of a block; the second one begins 5 cm and 1 degree off, and drifts on."""
    rng, truth = np.random.default_rng(0), way(2.0)
    scans = [scan_at(Pose2.of(pose), angles=FAN, walls=WALLS, rng=rng) for pose in truth]
    steps = between(truth[:-1], truth[1:])
    steps[:, 2] += math.radians(1.0) / len(steps)
    before = [truth[0]]
    for step in steps:
        before.append(compose(before[-1], step))
    before = np.array(before)
    after = Alignment()(seen(scans, before), before)
    assert largest(after, truth)[0] < 0.4 * largest(before, truth)[0]


def test_headings_far_apart_are_held_together_as_they_were() -> None:
    rng, truth = np.random.default_rng(4), loop(FAR + 40)
    scans = [scan_at(Pose2.of(pose), rng=rng) for pose in truth]
    before = disturbed(truth, rng, 0.01, 0.5)

    def change(bend: float) -> float:
        """RMS, rad, of what an alignment changes in the turn between keyframes FAR apart."""
        after = Alignment(bend=bend)(seen(scans, before), before)
        turns = [
            wrap_angle(poses[FAR::EVERY, 2] - poses[:-FAR:EVERY, 2]) for poses in (before, after)
        ]
        return float(np.sqrt((wrap_angle(turns[1] - turns[0]) ** 2).mean()))

    assert change(1e-5) < 0.1 * change(1.0)


def test_what_moved_counts_for_little() -> None:
    """A board of 0.6 m that stands elsewhere, 4 cm farther, in every other scan."""
    rng, truth = np.random.default_rng(1), loop(60)
    scans = []
    for k, pose in enumerate(truth):
        x = 0.4 + 0.04 * (k % 2)
        board = np.array([[x, -0.25, x, 0.35]])
        walls = np.vstack([ROOM, board])
        scans.append(scan_at(Pose2.of(pose), walls=walls, rng=rng))
    after = Alignment()(seen(scans, truth), truth)
    assert largest(after, truth)[0] < 0.01


def test_the_same_twice_and_nothing_of_the_input_is_changed() -> None:
    rng, truth = np.random.default_rng(2), loop(20)
    scans = [scan_at(Pose2.of(pose), rng=rng) for pose in truth]
    before = disturbed(truth, rng, 0.02, 0.5)
    kept = before.copy()
    first, second = (Alignment()(seen(scans, before), before) for _ in range(2))
    np.testing.assert_array_equal(first, second)
    np.testing.assert_array_equal(before, kept)


@pytest.mark.parametrize("fill", [math.inf, math.nan])
def test_without_echoes_the_poses_stay(fill: float) -> None:
    scans = [Scan(np.full(len(FAN), fill), FAN, 6.0, time=k / 5) for k in range(5)]
    poses = np.cumsum(np.full((5, 3), 0.1), axis=0)
    np.testing.assert_allclose(
        Alignment()(echoes_of(scans, poses, Static()), poses), poses, atol=1e-12
    )


def test_one_keyframe_stays() -> None:
    scans, poses = [scan_at(Pose2())], np.ones((1, 3))
    np.testing.assert_array_equal(Alignment()(seen(scans, poses), poses), poses)


# -- one link ----------------------------------------------------------------------------------


def pair(first: Pose2, second: Pose2, walls=None) -> Echoes:
    walls = ROOM if walls is None else walls
    scans = [scan_at(pose, walls=walls) for pose in (first, second)]
    return echoes_of(scans, np.array([first, second]), drawn(scans, [first, second]))


def compared(echoes: Echoes, displacement: Pose2):
    H, g = _compared(echoes, np.array([[0, 1]]), np.array([displacement]), MODEL)
    return H[0], g[0]


@pytest.mark.parametrize("error", [(0.01, 0, 0), (0, -0.01, 0), (0, 0, 0.005), (0.01, 0.01, -0.01)])
def test_a_link_measures_the_displacement(error) -> None:
    first, second = Pose2(0.2, 0.1, 0.3), Pose2(0.5, 0.2, 0.6)
    true, echoes = first.between(second), pair(first, second)
    here = true @ Pose2(*error)
    for _ in range(4):
        H, g = compared(echoes, here)
        here = here @ Pose2(*(-np.linalg.solve(H, g)).tolist())
    assert math.dist(here[:2], true[:2]) < 1e-3
    assert abs(here.theta - true.theta) < 1e-3


def test_its_curvature_is_positive_and_symmetric() -> None:
    H, _ = compared(pair(Pose2(0.2, 0.1), Pose2(0.4, 0.1)), Pose2(0.2, 0.0))
    np.testing.assert_array_equal(H, H.T)
    assert np.linalg.eigvalsh(H).min() > 0.0


def test_the_two_faces_of_a_wall_are_not_one() -> None:
    """A wall 4 cm thick, seen from the left and from the right."""
    sides = np.array([[1.0, -3.0, 1.0, 3.0], [1.04, -3.0, 1.04, 3.0]])
    left, right = Pose2(0.0, 0.0, 0.0), Pose2(2.04, 0.0, math.pi)
    echoes = pair(left, right, sides)
    assert len(echoes.points) > 50
    H, g = compared(echoes, left.between(right))
    assert not H.any()
    assert not g.any()


@pytest.mark.parametrize(("apart", "one"), [(0.11, True), (0.13, False)])
def test_surfaces_farther_apart_than_three_deviations_are_not_one(apart: float, one: bool) -> None:
    """A wall that stands farther away in the second scan; the deviation is 4 cm."""
    scans = [scan_at(Pose2(), walls=np.array([[x, -3.0, x, 3.0]])) for x in (1.0, 1.0 + apart)]
    poses = np.zeros((2, 3))
    H, g = compared(seen(scans, poses), Pose2())
    assert H.any() == g.any() == one


def test_a_wall_tells_nothing_of_the_place_along_it() -> None:
    H, _ = compared(pair(Pose2(), Pose2(0.3), np.array([[-50.0, 1.0, 50.0, 1.0]])), Pose2(0.3))
    assert H[1, 1] > 10.0
    assert H[0, 0] < 1e-4 * H[1, 1]


@pytest.mark.parametrize("wrong", [{"along": 0.0}, {"beta": -1.0}, {"z_rand": math.nan}])
def test_parts_are_checked(wrong) -> None:
    with pytest.raises(InputError):
        Alignment(**wrong)
