import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slam.geometry import Pose2, wrap_angle
from slam.motion.gaussian import GaussianMotion, Prediction, odometry_covariance

# -- how far the odometry may be off -----------------------------------------------------------


def test_deviations_by_hand() -> None:
    model = GaussianMotion(0.1, 0.05, 0.01, 0.5, 0.2, 0.02)
    translation = math.sqrt(0.2**2 + 0.025**2 + 0.01**2)
    rotation = math.sqrt(1.0**2 + 0.1**2 + 0.02**2)
    found = model.deviations(Pose2(1.2, -1.6, -0.5))
    np.testing.assert_allclose(found, [translation, translation, rotation])


moved = st.floats(0, 3)


@given(moved, moved, st.floats(1.01, 3))
def test_deviations_grow_with_what_was_moved(way: float, turn: float, factor: float) -> None:
    model = GaussianMotion()
    little = model.deviations(Pose2(way, 0.0, turn))
    assert (model.deviations(Pose2(way * factor, 0.0, turn)) >= little).all()
    assert (model.deviations(Pose2(way, 0.0, turn * factor)) >= little).all()
    assert (little >= model.deviations(Pose2())).all()
    assert (model.deviations(Pose2(way + 0.1, 0.0, turn + 0.1)) > little).all()


def test_the_default_is_as_wide_as_the_papers_systematic_error() -> None:
    assert GaussianMotion().deviations(Pose2(0.05, 0.0, 0.0))[2] >= math.radians(3.0)


def test_the_odometry_is_believed_as_it_is_for_ever() -> None:
    model, displacement = GaussianMotion(), Pose2(0.1, 0.02, 0.3)
    before = model.deviations(displacement)
    for _ in range(10):
        model.learn(displacement, Pose2(0.1, 0.0, 0.0), np.eye(3) * 1e-8)
    assert model.corrected(displacement) == displacement
    np.testing.assert_array_equal(model.deviations(displacement), before)


# -- where it leads, and how likely any other pose is ------------------------------------------

coordinate = st.floats(-50, 50)
heading = st.floats(-math.pi, math.pi)
way = st.floats(-0.6, 0.6)
origins = st.builds(Pose2, coordinate, coordinate, heading)
displacements = st.builds(Pose2, way, way, heading)
wide = st.floats(0.005, 2.0)
deviations = st.tuples(wide, wide, wide).map(np.array)
errors = st.tuples(way, way, st.floats(-3.1, 3.1)).map(lambda e: np.array([e]))


@given(origins, displacements)
def test_no_error_leads_where_the_odometry_does(origin, displacement) -> None:
    prediction = Prediction(origin, displacement, np.ones(3))
    assert prediction.pose == origin @ displacement
    found = prediction.poses(np.zeros((1, 3)))[0]
    np.testing.assert_allclose(found[:2], prediction.pose[:2], atol=1e-12)
    assert wrap_angle(found[2] - prediction.pose.theta) == pytest.approx(0.0, abs=1e-12)
    assert prediction.log_density(found[None])[0] == pytest.approx(0.0, abs=1e-12)


@given(origins, displacements, deviations, errors)
def test_density_is_a_gaussian_of_the_error_that_led_there(
    origin, displacement, width, error
) -> None:
    prediction = Prediction(origin, displacement, width)
    found = prediction.log_density(prediction.poses(error))[0]
    assert found == pytest.approx(-0.5 * ((error / width) ** 2).sum(), rel=1e-6, abs=1e-6)


@given(origins, displacements, errors)
def test_headings_stay_within_half_a_turn(origin, displacement, error) -> None:
    pose = Prediction(origin, displacement, np.ones(3)).poses(error)[0]
    assert -math.pi <= pose[2] <= math.pi
    assert wrap_angle(pose[2] - origin.theta - displacement.theta - error[0, 2]) == pytest.approx(
        0.0, abs=1e-9
    )


def test_many_errors_are_as_good_as_one_after_the_other() -> None:
    rng = np.random.default_rng(0)
    many = rng.normal(size=(20, 3))
    prediction = Prediction(Pose2(1, 2, 3), Pose2(0.3, 0.1, 0.2), np.array([0.1, 0.2, 0.3]))
    poses, before = prediction.poses(many), many.copy()
    alone = [prediction.poses(one[None])[0] for one in many]
    np.testing.assert_array_equal(poses, alone)
    values = [prediction.log_density(pose[None])[0] for pose in poses]
    np.testing.assert_array_equal(prediction.log_density(poses), values)
    np.testing.assert_array_equal(many, before)


def test_a_heading_counts_the_short_way() -> None:
    prediction = Prediction(Pose2(0.0, 0.0, math.pi - 0.01), Pose2(), np.full(3, 0.1))
    found = prediction.log_density(np.array([[0.0, 0.0, -math.pi + 0.01]]))
    assert found[0] == pytest.approx(-0.5 * 0.2**2)
    slope = prediction.slope(Pose2(0.0, 0.0, -math.pi + 0.01))
    assert slope[0] == pytest.approx(found[0])
    assert slope[1][2] == pytest.approx(-0.02 / 0.1**2)


def test_errors_are_in_the_frame_that_the_motion_leads_to() -> None:
    prediction = Prediction(Pose2(0, 0, math.pi / 4), Pose2(0, 0, math.pi / 4), np.ones(3))
    ahead, aside = prediction.poses(np.array([[0.1, 0, 0], [0, 0.1, 0]]))
    np.testing.assert_allclose(ahead, [0.0, 0.1, math.pi / 2], atol=1e-12)
    np.testing.assert_allclose(aside, [-0.1, 0.0, math.pi / 2], atol=1e-12)


@pytest.mark.parametrize("turned", [-0.4, -0.1, 0.0, 0.2, 0.5])
@pytest.mark.parametrize("bias", [math.radians(60), -math.radians(30)])
def test_half_of_a_heading_error_turns_the_way_as_a_constant_bias_does(turned, bias) -> None:
    """A drive of 20 cm on an arc, whose odometry turns `bias` rad per metre too far."""
    steps, origin = 400, Pose2(1.0, -2.0, 0.7)
    step = Pose2(0.2 / steps, 0.0, turned / steps)
    told = step @ Pose2(0.0, 0.0, bias * 0.2 / steps)
    truth, odometry = origin, Pose2()
    for _ in range(steps):
        truth, odometry = truth @ step, odometry @ told
    prediction = Prediction(origin, odometry, np.full(3, 0.1))
    found = prediction.poses(np.array([[0.0, 0.0, -0.2 * bias]]))[0]
    assert wrap_angle(found[2] - truth.theta) == pytest.approx(0.0, abs=1e-9)
    missed = math.dist(found[:2], truth[:2])
    unturned = math.dist(prediction.pose[:2], truth[:2])
    assert missed < 0.003
    assert missed < 0.15 * unturned


@settings(max_examples=60)
@given(origins, displacements, deviations, errors)
def test_slope_is_that_of_the_density(origin, displacement, width, error) -> None:
    prediction = Prediction(origin, displacement, width)
    pose = prediction.poses(0.9 * error)[0]
    value, gradient, curvature = prediction.slope(Pose2.of(pose))
    assert value == pytest.approx(prediction.log_density(pose[None])[0], rel=1e-9, abs=1e-9)
    h = 1e-5
    ahead = prediction.log_density(pose + h * np.eye(3))
    back = prediction.log_density(pose - h * np.eye(3))
    scale = 1.0 / width.min() ** 2
    np.testing.assert_allclose(gradient, (ahead - back) / (2 * h), atol=1e-4 * scale, rtol=1e-4)
    np.testing.assert_allclose(curvature, curvature.T, atol=1e-9 * scale)
    assert np.linalg.eigvalsh(curvature).max() <= 1e-9 * scale


@pytest.mark.parametrize("displacement", [Pose2(), Pose2(0.5, 0.2, 1.0), Pose2(-0.3, 0.4, -2.0)])
def test_curvature_at_the_prediction_is_the_densitys(displacement: Pose2) -> None:
    prediction = Prediction(Pose2(1, 2, 0.5), displacement, np.array([0.1, 0.2, 0.3]))
    pose, h = np.array(prediction.pose), 1e-4
    numeric: np.ndarray = np.empty((3, 3))
    for a in range(3):
        for b in range(3):
            offsets = h * (np.outer([1.0, 1, -1, -1], np.eye(3)[a])
                           + np.outer([1.0, -1, 1, -1], np.eye(3)[b]))  # fmt: skip
            f = prediction.log_density(np.asarray(pose + offsets, dtype=np.float64))
            numeric[a, b] = (f[0] - f[1] - f[2] + f[3]) / (4 * h * h)
    np.testing.assert_allclose(prediction.slope(Pose2.of(pose))[2], numeric, rtol=1e-3, atol=1e-2)


@pytest.mark.parametrize("displacement", [Pose2(), Pose2(0.5, 0.2, 1.0), Pose2(-0.3, 0.4, -2.0)])
def test_covariance_is_that_of_the_poses_that_small_errors_lead_to(displacement: Pose2) -> None:
    width = np.array([0.001, 0.002, 0.003])
    prediction = Prediction(Pose2(1, 2, 0.5), displacement, width)
    errors = np.random.default_rng(0).normal(size=(200_000, 3)) * width
    poses = prediction.poses(errors)
    found = odometry_covariance(*prediction.gaussian)
    np.testing.assert_allclose(np.cov(poses.T), found, rtol=0.02, atol=3e-8)
    np.testing.assert_allclose(
        np.linalg.inv(-prediction.slope(prediction.pose)[2]), found, atol=1e-12
    )
