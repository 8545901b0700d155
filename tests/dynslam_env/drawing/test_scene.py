import math

import numpy as np
import pytest

from dynslam_env.drawing.scene import belief_between, pose_between, scene_between
from slam.geometry import Pose2

from .scenes import belief, scene


def test_half_way_between_two_poses_by_the_short_turn():
    pose = pose_between(Pose2(0, 0, 3.0), Pose2(2, 4, -3.0), 0.5)
    assert (pose.x, pose.y) == (1, 2)
    assert math.cos(pose.theta) == pytest.approx(-1)


def test_the_ends_are_the_scenes_themselves():
    a, b = scene(Pose2(1, 1, 0)), scene(Pose2(2, 1, 0.4))
    b = b._replace(leaves=b.leaves + 0.3, people=b.people + 1.0)
    for share, end in ((0.0, a), (1.0, b)):
        between = scene_between(a, b, share)
        assert between.pose == pytest.approx(end.pose)
        np.testing.assert_allclose(between.leaves, end.leaves)
        np.testing.assert_allclose(between.people, end.people)
        assert between.taken_from == end.pose
        assert between.scan is end.scan


def test_a_scan_is_drawn_from_where_it_was_taken():
    a, b = scene(Pose2(1, 1, 0)), scene(Pose2(2, 1, 0))
    between = scene_between(a, b, 0.4)
    assert between.pose.x == pytest.approx(1.4)
    assert between.taken_from == a.pose


def test_a_belief_moves_too():
    a, b = belief(Pose2(1, 1, 0)), belief(Pose2(2, 1, 0))
    between = belief_between(a, b, 0.5)
    assert between.pose == (1.5, 1, 0)
    assert between.grid is b.grid
