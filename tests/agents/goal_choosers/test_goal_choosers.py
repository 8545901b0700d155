import math

import numpy as np
import pytest

from agents.goal_choosers.doors import DoorChooser, DoorVisit, LongestUnseen, RoundRobin
from agents.goal_choosers.frontiers import ExploreLite, FrontierChooser, nearest
from agents.goal_choosers.oracle import believed_closed
from agents.goal_choosers.pose_information import PoseInformation
from agents.path_patrol import PathPatrol
from agents.wall_follower import WALL_DISTANCE, WallFollower
from dynslam_env import Door
from dynslam_env.navigation.blacklist import BLACKLIST_TIME
from dynslam_env.navigation.doors_found import FoundDoor
from dynslam_env.navigation.frontiers import Frontier
from dynslam_env.navigation.goal import Goal
from dynslam_env.navigation.planner import plan
from dynslam_env.navigation.planning_snapshot import PlanningSnapshot
from slam import InputError, Pose2
from tests.dynslam_env.navigation.car import Car
from tests.dynslam_env.navigation.drawn import believed, drawn

TWO_GAPS = """
#####  #############
#..................#
#..................#
#..................
#..................
#..................
#..................
#..................#
####################
"""


def surveyed(text, x, y, time=0.0):
    costmap, pose = drawn(text), Pose2(x, y, 0.0)
    return PlanningSnapshot(time, pose, np.eye(3), believed("."), costmap, plan(costmap, pose))


def frontier(size, length):
    return Frontier(size, (0.0, 0.0), (1.0, 1.0), (0, 0), length, length)


def test_the_nearest_frontier_and_the_largest_are_not_the_same():
    seen = surveyed(TWO_GAPS, 0.55, 0.45)
    near = FrontierChooser(nearest, min_cells=2).goal(seen)
    large = FrontierChooser(ExploreLite(), min_cells=2).goal(seen)
    assert near is not None
    assert large is not None
    assert near.target == pytest.approx((0.6, 0.75), abs=0.06)
    assert large.target == pytest.approx((1.85, 0.4), abs=0.06)
    assert large.heading == pytest.approx(0.0, abs=0.4)


def test_explore_lites_cost():
    assert ExploreLite(2.0, 3.0, 0.1)(frontier(20, 1.5)) == pytest.approx(2.0 * 1.5 - 3.0 * 2.0)
    with pytest.raises(InputError, match="gain_scale"):
        ExploreLite(gain_scale=-1.0)


def test_where_no_frontier_is_left_it_stands_still_and_behind_a_wall_it_waits():
    choice = FrontierChooser(nearest, min_cells=1)
    assert choice.goal(surveyed("#####\n#...#\n#####", 0.25, 0.15)) is None
    waiting = choice.goal(surveyed("######....   \n#....#....   \n######....   ", 0.25, 0.15))
    assert waiting is not None
    assert waiting.cell in {(1, col) for col in range(1, 5)}


def test_a_place_on_the_blacklist_is_tried_again_later():
    seen, choice = surveyed(TWO_GAPS, 0.55, 0.45), FrontierChooser(nearest, min_cells=2)
    first = choice.goal(seen)
    assert first is not None
    choice.ended(first, False, 0.0)
    second, later = choice.goal(seen), choice.goal(seen._replace(time=BLACKLIST_TIME + 1.0))
    assert second is not None
    assert later is not None
    assert math.dist(second.target, first.target) > 1.0


def looks(*rows):
    return [
        DoorVisit(FoundDoor(np.array(place), 0.5, age, 0.1, 6), Goal((0, 0), 0.0, place), time)
        for place, age, time in rows
    ]


def test_round_robin_looks_at_each_once_a_round():
    order, found = RoundRobin(), looks(((0.0, 0.0), 1, 4), ((3.0, 0.0), 9, 5), ((6.0, 0.0), 3, 6))
    visited = []
    for _ in range(3):
        look = order.pick(found, 0.0)
        assert look is not None
        visited.append(look.goal.target)
        order.ended(look.goal, 0.0)
    assert visited == [(0.0, 0.0), (3.0, 0.0), (6.0, 0.0)]
    assert order.pick(found, 0.0) is None  # between two rounds it explores
    again = order.pick(found, 60.0)
    assert again is not None
    assert again.goal.target == (0.0, 0.0)


def test_longest_unseen_weighs_the_age_with_the_way():
    old, far = ((0.0, 0.0), 40.0, 5.0), ((9.0, 0.0), 60.0, 20.0)
    look = LongestUnseen().pick(looks(old, far), 0.0)
    assert look is not None
    assert look.goal.target == (0.0, 0.0)
    assert LongestUnseen().pick(looks(((0.0, 0.0), 1.0, 5.0)), 0.0) is None


def test_a_door_that_is_taken_for_want_of_a_frontier_counts_as_looked_at(monkeypatch):
    order = RoundRobin()
    choice, seen = DoorChooser(order), surveyed("..\n..", 0.05, 0.05)
    (only,) = looks(((3.0, 0.0), 9, 5))
    monkeypatch.setattr(choice, "_visits", lambda planning: [only])
    monkeypatch.setattr(choice._explorer, "goal", lambda planning: None)
    assert choice.goal(seen) == only.goal
    choice.ended(only.goal, True, 5.0)
    assert choice._blacklist.holds(only.goal.target, 5.1)
    assert order._visited == [only.goal.target]


def test_a_revisit_makes_the_pose_surer_and_a_new_place_does_not():
    term, text = PoseInformation(), "." * 400
    for x in np.arange(0.5, 30.0, 0.5):
        seen = surveyed(text, float(x), 0.05)
        term.follow(seen._replace(covariance=np.eye(3) * 1e-4 * x))
    begin, end = np.array([(1.0, 0.05)]), np.array([(35.0, 0.05)])
    assert term.bits(begin, np.array([28.0]))[0] > 0.0
    assert term.bits(end, np.array([6.0]))[0] == 0.0


def test_p_closed_is_what_the_map_has_along_the_closed_leaf():
    door = Door((0.6, 0.75), 0.0, 1, 0.9, 0.04)
    wall, gap = "#" * 14, "####......####"
    free = "." * 14
    rows = [free] * 5
    shut = believed("\n".join([*rows, wall, *rows]))
    ajar = believed("\n".join([*rows, gap, *rows]))
    assert believed_closed(shut, door) == pytest.approx(1.0)
    assert believed_closed(ajar, door) == pytest.approx(0.0)
    assert believed_closed(believed(" "), door) == pytest.approx(0.5)


def test_the_path_is_driven_to_and_fro():
    car = Car()
    agent, trail = PathPatrol(car, np.array([(0.0, 0.0), (2.0, 0.0), (2.0, 1.5)])), []
    for _ in range(200):
        action, _ = agent.predict()
        car.drive(*(action * car.limits))
        trail.append(car.pose[:2])
    ends = [np.hypot(*(np.array(trail) - end).T) < 0.3 for end in ((0.0, 0.0), (2.0, 1.5))]
    visits = [int((np.diff(at.astype(int)) == 1).sum()) for at in ends]
    assert min(visits) >= 2
    with pytest.raises(InputError, match="path"):
        PathPatrol(car, np.zeros((0, 2)))


def test_the_wall_follower_keeps_its_distance():
    wall = [(x, s) for x in np.arange(-2.0, 12.0, 0.02) for s in (-0.8, 0.8)]
    car = Car(Pose2(), wall)
    agent = WallFollower(car, seed=0)
    for _ in range(40):
        action, _ = agent.predict()
        car.drive(*(action * car.limits))
    assert car.pose.x > 4.0
    assert 0.8 - abs(car.pose.y) == pytest.approx(WALL_DISTANCE, abs=0.12)
