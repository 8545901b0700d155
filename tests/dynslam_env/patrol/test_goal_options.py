import math

import numpy as np
import pytest

from dynslam_env.navigation.blacklist import BLACKLIST_TIME, Blacklist
from dynslam_env.navigation.planner import plan
from dynslam_env.navigation.planning_snapshot import PlanningSnapshot
from dynslam_env.patrol.goal_options import (
    DOOR_SLOTS,
    FRONTIER_SLOTS,
    SLOTS,
    TURN_ANGLE,
    goal_options,
)
from slam import Pose2
from tests.dynslam_env.navigation.drawn import believed, drawn

ROOM = """
####       #########
#..................#
#..................#
#..................
#..................
#..................
#..................
#..................
#..................#
####################
"""
HALL = ("." * 60 + "\n") * 40
TWO_DOORS = """
........................................
........................................
........................................
####~~~~~~###############~~~~~~#########
........................................
........................................
"""
NOTHING_CHANGES = believed(".")


def seen(text, pose, beliefs=NOTHING_CHANGES, time=0.0):
    costmap = drawn(text)
    return PlanningSnapshot(time, pose, np.eye(3), beliefs, costmap, plan(costmap, pose))


def two_doors(ages):
    """The left one at (1.05, 0.4) m, the right one at (4.2, 0.4)."""
    beliefs = believed(TWO_DOORS)
    beliefs.age[:, :20], beliefs.age[:, 20:] = ages
    return beliefs


def test_there_is_always_a_turn_and_the_rest_may_be_empty():
    offered = goal_options(seen(HALL, Pose2(1.0, 1.0, 0.3)), Blacklist())
    assert offered.mask.tolist() == [True] + [False] * (FRONTIER_SLOTS + DOOR_SLOTS)
    goal = offered.chosen(0).goal
    assert goal.cell == (10, 10)
    assert goal.heading == pytest.approx(0.3 + TURN_ANGLE - math.tau)
    assert offered.chosen(SLOTS - 1) is offered.chosen(0)
    rows = offered.features()
    assert rows[0].tolist() == [1, 0, 0, 0, 0, 0, 0]
    assert not rows[1:].any()


def test_frontiers_come_in_the_order_of_the_way_there():
    offered = goal_options(seen(ROOM, Pose2(1.55, 0.55, 0.0)), Blacklist())
    assert offered.mask.tolist() == [True, True, True] + [False] * 6
    near, far = offered.chosen(1), offered.chosen(2)
    assert near.goal.target == pytest.approx((1.85, 0.45), abs=0.01)
    assert far.goal.target == pytest.approx((0.75, 0.85), abs=0.01)
    row = offered.features()[1]
    x, y = 1.85 - 1.55, 0.45 - 0.55
    away = offered.planning.plan.length[near.goal.cell]
    expected = [1, away / 10, x / math.hypot(x, y), y / math.hypot(x, y),
                math.log(5) / math.log(200), 1, 0]  # fmt: skip
    assert row == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize(("ages", "first"), [((30.0, 5.0), 1.05), ((5.0, 30.0), 4.2)])
def test_the_door_unseen_longest_comes_first(ages, first):
    offered = goal_options(seen(HALL, Pose2(2.5, 2.0, math.pi), two_doors(ages)), Blacklist())
    assert offered.mask[1 + FRONTIER_SLOTS :].tolist() == [True, True, False, False]
    assert offered.chosen(1 + FRONTIER_SLOTS).goal.target[0] == pytest.approx(first, abs=0.1)
    row = offered.features()[1 + FRONTIER_SLOTS]
    assert row[2] == pytest.approx(np.sign(2.5 - first), abs=0.6)
    assert row[4:] == pytest.approx([0.0, 1 - math.exp(-1.5), 0.5])


def test_what_the_blacklist_holds_is_left_out_and_others_move_up():
    planning, blacklist = seen(ROOM, Pose2(1.55, 0.55, 0.0)), Blacklist()
    first, second = (goal_options(planning, blacklist).chosen(k) for k in (1, 2))
    blacklist.add(first.goal.target, 0.0, first.rest)
    assert goal_options(planning, blacklist).chosen(1) == second
    later = planning._replace(time=BLACKLIST_TIME + 1)
    assert goal_options(later, blacklist).chosen(1).goal == first.goal
