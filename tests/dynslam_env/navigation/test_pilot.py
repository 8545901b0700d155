import math

import numpy as np
import pytest

from dynslam_env.navigation.follower import GOAL_TOLERANCE, HEADING_TOLERANCE
from dynslam_env.navigation.frontiers import frontiers
from dynslam_env.navigation.goal import Goal, explore, look_at
from dynslam_env.navigation.pilot import Pilot
from dynslam_env.navigation.planner import plan
from dynslam_env.navigation.planning_snapshot import PlanningSnapshot
from dynslam_env.navigation.recovery import BACK_UP
from slam import Pose2
from tests.dynslam_env.navigation.car import Car
from tests.dynslam_env.navigation.drawn import believed, drawn

HALL = ("." * 40 + "\n") * 30
PARTED = ("." * 25 + "#" + "." * 14 + "\n") * 30
GAP = "#..................#\n" * 3 + "#..................\n" * 6 + "#..................#\n" * 3


def seen(text, pose):
    costmap = drawn(text)
    return PlanningSnapshot(0.0, pose, np.eye(3), believed("."), costmap, plan(costmap, pose))


def new_pilot():
    return Pilot(np.random.default_rng(0))


def test_it_drives_to_the_goal_and_looks_there():
    car, goal = Car(Pose2(0.55, 0.55, 2.0)), Goal((20, 30), -1.0, (0.0, 0.0))
    pilot = new_pilot()
    pilot.go(goal, seen(HALL, car.pose))
    for _ in range(100):
        if pilot.arrived(car.snapshot()):
            break
        car.drive(*(pilot.action(car.snapshot()) * car.limits))
    assert pilot.arrived(car.snapshot())
    assert pilot.goal == goal
    assert math.dist(car.pose[:2], (3.05, 2.05)) < 2 * GOAL_TOLERANCE
    assert abs(math.remainder(car.pose.theta + 1.0, math.tau)) < HEADING_TOLERANCE


def test_a_goal_is_found_again_on_a_later_map_and_given_up_where_no_way_leads():
    car, goal = Car(Pose2(0.55, 0.55, 0.0)), Goal((20, 30), None, (0.0, 0.0))
    pilot, here = new_pilot(), seen(HALL, car.pose)
    assert pilot.goal_in(here) is None
    pilot.go(goal, here)
    spec = here.costmap.spec._replace(row0=-5, col0=-3)
    wider = here._replace(costmap=here.costmap._replace(spec=spec))
    found = pilot.goal_in(wider)
    assert found is not None
    assert found.cell == (25, 33)
    pilot.replan(seen(PARTED, car.pose))
    assert pilot.goal is None
    assert pilot.action(car.snapshot()).tolist() == [0.0, 0.0]


def test_before_what_the_map_does_not_know_it_gets_stuck_and_backs_off():
    wall = [(1.5, y) for y in np.arange(-1.0, 3.0, 0.02)]
    car = Car(Pose2(0.55, 0.55, 0.0), wall)
    pilot, actions = new_pilot(), []
    pilot.go(Goal((5, 30), None, (0.0, 0.0)), seen(HALL, car.pose))
    for _ in range(100):
        actions.append(pilot.action(car.snapshot()))
        if pilot.stuck:
            break
        assert not pilot.recovering(car.snapshot())
        car.drive(*(actions[-1] * car.limits))
    assert pilot.stuck
    assert actions[-1] == pytest.approx(np.divide(BACK_UP, car.limits))
    assert pilot.recovering(car.snapshot())
    pilot.action(car.snapshot())
    assert not pilot.stuck


def test_a_frontier_is_looked_beyond_from_before_it_and_a_door_from_where_it_is_seen():
    planning = seen(GAP, Pose2(0.55, 0.55, 0.0))
    (frontier,) = frontiers(planning.costmap, planning.plan, planning.position)
    goal = explore(planning, frontier)
    assert goal is not None
    assert goal.target == pytest.approx((1.85, 0.6))
    assert goal.heading == pytest.approx(0.0, abs=0.4)
    assert explore(planning, frontier._replace(cell=None)) is None
    centre = np.array([1.65, 0.55])
    looked = look_at(planning, centre)
    assert looked is not None
    assert looked.heading == pytest.approx(0.0, abs=0.2)
    assert looked.target == (1.65, 0.55)
    assert look_at(planning, np.array([30.0, 0.5])) is None
