"""Poses that are wrong within the map: in relation to what was drawn there first."""

import math

import numpy as np

from slam.geometry import Array, Pose2, compose
from slam.metrics.within_map import wrong_within_map

N = 100
BELIEVED = np.ones(N, dtype=bool)


def line(step: float = 0.1) -> Array:
    """Poses along a straight line, there and back."""
    x = step * np.concatenate([np.arange(N // 2), np.arange(N // 2)[::-1]])
    poses = np.column_stack([x, np.zeros(N), np.repeat([0.0, math.pi], N // 2)])
    return poses.astype(np.float64)


def test_an_error_that_all_of_the_map_shares_is_none():
    truth = line()
    assert not wrong_within_map(compose(Pose2(5.0, 3.0, 1.0), truth), truth, BELIEVED).any()


def test_a_map_that_is_too_long_is_right_until_the_robot_contradicts_it():
    truth = line(step=0.4)
    long = truth * [1.1, 1.0, 1.0]
    assert not wrong_within_map(long, truth, BELIEVED).any()  # also on the way back
    slipped = truth.copy()
    slipped[N // 2 :, 0] += 0.5  # on the way back only
    assert wrong_within_map(slipped, truth, BELIEVED)[N // 2 :].all()


def test_a_jump_on_the_way_into_the_unknown_is_wrong_while_the_old_place_is_seen():
    truth = line(step=0.1)[: N // 2]
    slipped = truth.copy()
    slipped[20:, 0] += 0.5
    wrong = wrong_within_map(slipped, truth, BELIEVED[: N // 2])
    assert not wrong[:20].any()
    assert wrong[20:33].all()
    assert not wrong[45:].any()


def test_what_a_lost_robot_saw_is_no_part_of_the_map():
    truth = line()
    poses, drawn = truth.copy(), BELIEVED.copy()
    poses[20:50] += [3.0, 0.0, 0.0]
    drawn[20:50] = False
    wrong = wrong_within_map(poses, truth, drawn)
    assert wrong[20:50].all()
    assert not wrong[50:].any()  # it is back where it was before


def test_a_turn_alone_is_wrong():
    truth = line()
    poses = truth.copy()
    poses[60:, 2] += math.radians(11.0)
    assert wrong_within_map(poses, truth, BELIEVED).tolist() == [False] * 60 + [True] * 40


def there_and_back() -> Array:
    """Ten poses along the x axis."""
    truth = np.zeros((10, 3))
    truth[:, 0] = [0.0, 0.1, 0.2, 0.3, 0.4, 0.4, 0.3, 0.2, 0.1, 0.0]
    return truth


def test_scans_that_were_mapped_again_are_compared_with_the_map_that_holds_them() -> None:
    truth = there_and_back()
    poses = truth.copy()
    poses[:4, 1] = 1.0  # then found to be wrong, and mapped again
    drawn = np.ones(10, bool)
    assert wrong_within_map(poses, truth, drawn).tolist() == [False] * 4 + [True] * 6
    assert not wrong_within_map(poses, truth, drawn, [truth[:5]]).any()
    wrong = wrong_within_map(poses, truth, drawn, [truth[:5] + [1.0, 0.0, 0.0]])
    assert wrong.tolist() == [False] * 4 + [True] * 6


def test_each_pose_is_compared_with_the_map_of_its_time() -> None:
    truth = there_and_back()
    moved = np.array([0.0, 1.0, 0.0])
    poses = truth + np.repeat([[0.0], [1.0], [0.0]], [4, 3, 3], axis=0) * moved
    drawn = np.ones(10, bool)
    revisions = [truth[:5] + moved, truth[:8]]  # moved by the 5th, and back by the 8th
    assert not wrong_within_map(poses, truth, drawn, revisions).any()
    wrong = wrong_within_map(poses, truth, drawn, revisions[:1])
    assert wrong.tolist() == [False] * 7 + [True] * 3
