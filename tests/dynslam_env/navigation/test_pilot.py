import math

import numpy as np
import pytest

from dynslam_env.navigation.follower import FACED, REACH
from dynslam_env.navigation.frontiers import frontiers
from dynslam_env.navigation.goal import Goal, explore, look_at
from dynslam_env.navigation.pilot import Pilot
from dynslam_env.navigation.planner import plan
from dynslam_env.navigation.recovery import BACK
from dynslam_env.navigation.survey import PlanningSnapshot
from slam import Pose2
from tests.dynslam_env.navigation.car import Car
from tests.dynslam_env.navigation.drawn import believed, drawn

HALL = ("." * 40 + "\n") * 30
PARTED = ("." * 25 + "#" + "." * 14 + "\n") * 30
GAP = "#..................#\n" * 3 + "#..................\n" * 6 + "#..................#\n" * 3


def seen(text, pose):
    costmap = drawn(text)
    return PlanningSnapshot(0.0, pose, believed("."), costmap, plan(costmap, pose))


def pilot_of(car):
    return Pilot(car, np.random.default_rng(0))


def test_it_drives_to_the_goal_and_looks_there():
    car, goal = Car(Pose2(0.55, 0.55, 2.0)), Goal((20, 30), -1.0, (0.0, 0.0))
    pilot = pilot_of(car)
    pilot.go(goal, seen(HALL, car.pose))
    for _ in range(100):
        if pilot.arrived:
            break
        car.drive(*(pilot.action() * car.limits))
    assert pilot.arrived
    assert pilot.goal == goal
    assert math.dist(car.pose[:2], (3.05, 2.05)) < 2 * REACH
    assert abs(math.remainder(car.pose.theta + 1.0, math.tau)) < FACED


def test_a_goal_is_found_again_on_a_later_map_and_given_up_where_no_way_leads():
    car, goal = Car(Pose2(0.55, 0.55, 0.0)), Goal((20, 30), None, (0.0, 0.0))
    pilot, here = pilot_of(car), seen(HALL, car.pose)
    assert pilot.goal_in(here) is None
    pilot.go(goal, here)
    spec = here.costmap.spec._replace(row0=-5, col0=-3)
    wider = here._replace(costmap=here.costmap._replace(spec=spec))
    found = pilot.goal_in(wider)
    assert found is not None
    assert found.cell == (25, 33)
    pilot.replan(seen(PARTED, car.pose))
    assert pilot.goal is None
    assert pilot.action().tolist() == [0.0, 0.0]


def test_before_what_the_map_does_not_know_it_gets_stuck_and_backs_off():
    wall = [(1.5, y) for y in np.arange(-1.0, 3.0, 0.02)]
    car = Car(Pose2(0.55, 0.55, 0.0), wall)
    pilot, actions = pilot_of(car), []
    pilot.go(Goal((5, 30), None, (0.0, 0.0)), seen(HALL, car.pose))
    for _ in range(100):
        actions.append(pilot.action())
        if pilot.stuck:
            break
        assert not pilot.recovering
        car.drive(*(actions[-1] * car.limits))
    assert pilot.stuck
    assert actions[-1] == pytest.approx(np.divide(BACK, car.limits))
    assert pilot.recovering
    pilot.action()
    assert not pilot.stuck


def test_a_frontier_is_looked_beyond_from_before_it_and_a_door_from_where_it_is_seen():
    survey = seen(GAP, Pose2(0.55, 0.55, 0.0))
    (frontier,) = frontiers(survey.costmap, survey.plan, survey.position)
    goal = explore(survey, frontier)
    assert goal is not None
    assert goal.target == pytest.approx((1.85, 0.6))
    assert goal.heading == pytest.approx(0.0, abs=0.4)
    assert explore(survey, frontier._replace(cell=None)) is None
    centre = np.array([1.65, 0.55])
    looked = look_at(survey, centre)
    assert looked is not None
    assert looked.heading == pytest.approx(0.0, abs=0.2)
    assert looked.target == (1.65, 0.55)
    assert look_at(survey, np.array([30.0, 0.5])) is None
