import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from slam.geometry import (
    Pose2,
    between,
    compose,
    inverse,
    lever_jacobian,
    transform_points,
    turned,
    wrap_angle,
)

metres = st.floats(-100, 100)
poses = st.builds(Pose2, metres, metres, st.floats(-math.pi, math.pi))


def assert_same(a, b) -> None:
    """Equal poses, headings being equal modulo a turn."""
    difference = np.asarray(a) - np.asarray(b)
    np.testing.assert_allclose(difference[..., :2], 0, atol=1e-9)
    np.testing.assert_allclose(np.cos(difference[..., 2]), 1, atol=1e-12)


def matrix(pose: Pose2) -> np.ndarray:
    c, s = math.cos(pose.theta), math.sin(pose.theta)
    return np.array([[c, -s, pose.x], [s, c, pose.y], [0, 0, 1]])


@given(poses, poses)
def test_composition_is_the_product_of_matrices(a: Pose2, b: Pose2) -> None:
    np.testing.assert_allclose(matrix(a @ b), matrix(a) @ matrix(b), atol=1e-9)


@given(poses)
def test_inverse_composed_with_the_pose_is_the_identity(pose: Pose2) -> None:
    assert_same(pose.inverse() @ pose, Pose2())
    assert_same(pose @ pose.inverse(), Pose2())


@given(poses, poses)
def test_between_leads_from_one_pose_to_the_other(a: Pose2, b: Pose2) -> None:
    assert_same(a @ a.between(b), b)


@given(st.lists(poses, min_size=1, max_size=5), poses)
def test_arrays_agree_with_single_poses(many: list[Pose2], one: Pose2) -> None:
    array = np.array(many)
    assert_same(compose(array, one), [p @ one for p in many])
    assert_same(compose(one, array), [one @ p for p in many])
    assert_same(inverse(array), [p.inverse() for p in many])
    assert_same(between(array, one), [p.between(one) for p in many])


@given(st.floats(-1e3, 1e3))
def test_wrapped_angles_point_the_same_way_within_half_a_turn(angle: float) -> None:
    wrapped = float(wrap_angle(angle))
    assert -math.pi <= wrapped <= math.pi
    assert abs(math.remainder(wrapped - angle, math.tau)) < 1e-9


def test_wrap_angle_keeps_shape_and_sends_pi_to_minus_pi() -> None:
    assert wrap_angle(np.zeros((2, 3))).shape == (2, 3)
    assert wrap_angle([math.pi, -math.pi]).tolist() == [-math.pi, -math.pi]


@given(poses, metres, metres)
def test_points_move_as_poses_do(pose: Pose2, x: float, y: float) -> None:
    moved = pose @ Pose2(x, y)
    np.testing.assert_allclose(transform_points(pose, [[x, y]]), [moved[:2]], atol=1e-9)


def test_of_takes_any_three_numbers() -> None:
    assert Pose2.of(np.array([1, 2, 3])) == Pose2(1.0, 2.0, 3.0)


@given(poses)
def test_what_is_turned_is_what_a_frame_makes_of_it(pose: Pose2) -> None:
    np.testing.assert_allclose(turned(pose.theta)[:2, :2], matrix(pose)[:2, :2])
    np.testing.assert_array_equal(turned(pose.theta)[2], [0, 0, 1])
    np.testing.assert_array_equal(turned(pose.theta)[:, 2], [0, 0, 1])


@given(poses, st.floats(-5, 5), st.floats(-5, 5))
def test_the_lever_is_the_derivative_of_a_rigidly_attached_pose(frame: Pose2, x, y) -> None:
    attached = frame.between(Pose2(frame.x + x, frame.y + y, frame.theta))
    for axis, column in enumerate(lever_jacobian(x, y).T):
        e = 1e-6 * np.eye(3)[axis]
        ahead, back = (np.array(Pose2.of(np.array(frame) + d) @ attached) for d in (e, -e))
        difference = ahead - back
        difference[2] = math.remainder(difference[2], math.tau)
        np.testing.assert_allclose(difference / 2e-6, column, atol=1e-6)
