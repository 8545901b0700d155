import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from dynslam_env.navigation.follower import GOAL_TOLERANCE, HEADING_TOLERANCE, Follower, State
from dynslam_env.navigation.guard import ECHO_MARGIN, contact_ahead, free_length, guarded
from dynslam_env.navigation.pursuit import Command, PathProgress, arc_to
from slam import Pose2
from tests.dynslam_env.navigation.car import Car

WIDE = np.full(100, 2.0)


def drive(car, follower, steps=200):
    trail = [car.pose]
    for _ in range(steps):
        if follower.arrived(car.pose):
            break
        car.drive(*follower.command(car.snapshot()))
        trail.append(car.pose)
    return np.array(trail)


@pytest.mark.parametrize("theta", [0.0, 1.5, 3.1, -2.0])
def test_it_follows_a_path_round_a_corner_and_looks_where_it_is_to(theta):
    path = np.array([(0.0, 0.0), (2.0, 0.0), (2.0, 2.0)])
    car = Car(Pose2(0.0, 0.0, theta))
    follower = Follower()
    follower.follow(path, -1.0, WIDE)
    trail = drive(car, follower)
    assert follower.arrived(car.pose)
    assert math.dist(car.pose[:2], (2.0, 2.0)) < 2 * GOAL_TOLERANCE
    assert abs(math.remainder(car.pose.theta + 1.0, math.tau)) < HEADING_TOLERANCE
    off_first, off_second = np.abs(trail[:, 1]), np.abs(trail[:, 0] - 2.0)
    assert np.minimum(off_first, off_second).max() < 0.25


@given(st.floats(-3.1, 3.1), st.floats(-3.1, 3.1))
def test_a_turn_on_the_spot_never_overshoots_to_and_fro(begin, end):
    car = Car(Pose2(0.0, 0.0, begin))
    follower = Follower()
    follower.follow(np.zeros((1, 2)), end, WIDE)
    left = [abs(math.remainder(theta - end, math.tau)) for theta in drive(car, follower, 40)[:, 2]]
    assert follower.arrived(car.pose)
    assert all(later <= sooner + 1e-9 for sooner, later in pairwise(left))


def test_it_stops_before_what_the_map_does_not_know():
    wall = [(1.5, y) for y in np.arange(-1.0, 1.0, 0.02)]
    car = Car(Pose2(), wall)
    follower = Follower()
    follower.follow(np.array([(0.0, 0.0), (3.0, 0.0)]), None, WIDE)
    drive(car, follower, 60)
    assert not follower.arrived(car.pose)
    assert follower.state is State.DRIVING
    assert car.closest >= car.robot.radius
    assert car.pose.x > 1.0


def test_without_a_path_it_stands_still():
    follower = Follower()
    assert follower.command(Car().snapshot()) == (0.0, 0.0)
    assert follower.state is State.STANDING


def test_beside_obstacles_it_drives_slowly():
    fast, slow = Car(), Car()
    for car, clearance in ((fast, 2.0), (slow, 0.3)):
        follower = Follower()
        follower.follow(np.array([(0.0, 0.0), (9.0, 0.0)]), None, np.full(2, clearance))
        drive(car, follower, 5)
    assert slow.pose.x < fast.pose.x / 2


def naive_free_length(points, curvature, radius, reach):
    """Fine steps along the arc, one pose after the other."""
    pose, step = Pose2(), 0.001
    for k in range(int(reach / step)):
        pose = pose @ Pose2(step, curvature * step**2 / 2, curvature * step)
        for x, y in points:
            away = math.dist((x, y), pose[:2])
            if away < radius and away < math.hypot(x, y):
                return k * step
    return reach


@given(st.integers(0, 2**32 - 1))
@example(351)  # its arc grazes an echo between two of the checked poses
@example(58949)
def test_the_free_length_of_an_arc_is_that_of_a_slow_loop(seed):
    """Poses are checked 5 cm apart, so an echo that enters the disc by 2 mm at most between two of
    them, (s / 2)^2 / 2 (1 / radius + |curvature|), may be missed."""
    rng = np.random.default_rng(seed)
    points = rng.uniform((0.3, -1.0), (1.5, 1.0), (4, 2))
    scan = Car(Pose2(), points).scan
    curvature = float(rng.uniform(-2, 2))
    found = free_length(scan, curvature, 0.25, 1.0)
    assert found >= naive_free_length(scan.points, curvature, 0.25 + 1e-4, 1.0) - 0.052
    assert found <= naive_free_length(scan.points, curvature, 0.25 - 0.002, 1.0) + 0.002


def test_what_touches_its_side_does_not_hold_a_robot_that_drives_past():
    assert free_length(Car(Pose2(), [(0.02, 0.23)]).scan, 0.0, 0.26) > 1.0
    assert free_length(Car(Pose2(), [(0.15, 0.2)]).scan, 0.0, 0.26) == 0.0


@given(st.floats(0.3, 3.0), st.floats(0.05, 1.2))
def test_a_guarded_command_can_be_stopped_in_time(distance, v):
    car = Car(Pose2(), [(distance, 0.0)])
    command = guarded(Command(v, 0.0), car.scan, car.robot, car.period)
    stopping = command.v * car.period + command.v**2 / (2 * car.robot.acceleration)
    assert stopping <= max(distance - car.robot.radius - ECHO_MARGIN, 0.0) + 1e-6
    assert command.v <= v


def test_a_leaf_against_its_front_presses_the_robot():
    robot = Car().robot
    assert contact_ahead(Car(Pose2(), [(0.23, 0.0)]).scan, robot)
    assert not contact_ahead(Car(Pose2(), [(0.0, 0.23)]).scan, robot)
    assert not contact_ahead(Car(Pose2(), [(0.5, 0.0)]).scan, robot)


def test_an_arc_passes_through_its_target():
    v, omega = arc_to(Pose2(), (0.4, 0.2), 0.5, math.hypot(0.4, 0.2))
    radius = v / omega
    assert math.dist((0.0, radius), (0.4, 0.2)) == pytest.approx(radius)


def test_the_lookahead_point_never_moves_back():
    path = PathProgress(np.array([(0.0, 0.0), (5.0, 0.0)]))
    assert path.lookahead_point(Pose2(1.0, 0.1), 0.9) == pytest.approx((1.8, 0.0), abs=0.11)
    before = path.travelled
    path.lookahead_point(Pose2(0.0, 0.0), 0.9)
    assert path.travelled == before
    assert path.remaining == pytest.approx(5.0 - before)
