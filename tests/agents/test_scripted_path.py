import math

import numpy as np
import pytest

from agents import ScriptedPath, record_corridor
from slam import InputError, Pose2

FIELDS = ("ranges", "angles", "max_range", "time")


@pytest.fixture(scope="module")
def pair():
    return record_corridor(0, "moving"), record_corridor(0, "static")


def test_it_drives_the_passage_and_back_in_the_middle(pair):
    poses = pair[0].truth.poses
    assert poses[:, 0].max() == pytest.approx(11.2, abs=0.15)
    assert poses[-1, 0] < 1.1
    assert np.abs(poses[:, 1]).max() < 0.1
    assert 35 < pair[0].times[-1] < 50


def test_paired_episodes_differ_in_the_doors_alone(pair):
    moving, static = pair
    assert moving.truth.poses.tobytes() == static.truth.poses.tobytes()
    assert moving.truth.walls.tobytes() == static.truth.walls.tobytes()
    assert moving.odometry.poses.tobytes() == static.odometry.poses.tobytes()
    assert moving.truth.doors[0].tobytes() == static.truth.doors[0].tobytes()
    assert (static.truth.doors == static.truth.doors[0]).all()
    assert (moving.truth.doors != static.truth.doors).any()
    same = np.array([(a.ranges == b.ranges).mean() for a, b in zip(*scans(pair), strict=True)])
    assert same[0] == 1.0
    assert same.min() < 0.999 < np.sort(same)[-10]


def scans(pair):
    return pair[0].scans, pair[1].scans


def test_the_raw_odometry_goes_round_in_circles_of_95_cm(pair):
    points = pair[0].odometry.poses[:100, :2]  # straight on, at first
    # the algebraic circle fit: x^2 + y^2 = 2 a x + 2 b y + c
    rows = np.column_stack([2 * points, np.ones(len(points))])
    (a, b, c), *_ = np.linalg.lstsq(rows, (points**2).sum(1), rcond=None)
    assert math.sqrt(c + a * a + b * b) == pytest.approx(0.955, abs=0.05)


def test_another_seed_is_another_episode(pair):
    other = record_corridor(1, "moving")
    assert other.truth is not None
    assert other.truth.walls.tobytes() != pair[0].truth.walls.tobytes()


class Car:
    """A robot that does at once what it is told."""

    def __init__(self, pose):
        self.pose, self.v = pose, 0.0

    def drive(self, action):
        self.v, omega = float(action[0]) * 1.2, float(action[1]) * 5.2
        self.pose = self.pose @ Pose2(self.v * 0.1, 0.0, omega * 0.1)


@pytest.mark.parametrize("start", [Pose2(0, 0, 0), Pose2(0.3, -0.8, 3.0)])
def test_it_passes_every_waypoint_and_stops_at_the_last(start):
    car = Car(start)
    waypoints = np.array([(0.0, 0), (3, 0), (3, 2), (0, 2)])
    path, nearest = ScriptedPath(waypoints, lambda: car.pose), np.full(4, np.inf)
    for _ in range(600):
        action, _ = path.predict()
        assert np.abs(action).max() <= 1.0
        car.drive(action)
        nearest = np.minimum(nearest, np.hypot(*(waypoints - car.pose[:2]).T))
    assert nearest.max() < 0.12
    assert path.finished
    assert car.v == 0.0


@pytest.mark.parametrize(("short", "turn", "then"), [(0.48, -1.45, -2.88), (0.66, 1.98, -3.12)])
def test_legs_too_short_to_steer_on_are_driven_past(short, turn, then):
    car, corner = Car(Pose2(0, 0, 0)), np.array([2.0, 0.0])
    behind = corner + short * np.array([np.cos(turn), np.sin(turn)])
    waypoints = np.array([corner, behind, behind + 2 * np.array([np.cos(then), np.sin(then)])])
    path = ScriptedPath(waypoints, lambda: car.pose)
    for _ in range(500):
        car.drive(path.predict()[0])
    assert path.finished


def test_wrong_waypoints_are_refused():
    with pytest.raises(InputError, match=r"waypoints have shape \(p, 2\)"):
        ScriptedPath(np.zeros((3, 3)), Pose2)


WAYPOINTS = np.array([(0.0, 0), (3, 0), (3, 2), (0, 2)])


@pytest.mark.parametrize("put", [Pose2(0.5, 0.0, 0.0), Pose2(1.0, 0.0, 3.0), Pose2(3.0, 1.0, 1.6)])
def test_a_robot_that_was_carried_goes_on_from_where_it_is(put):
    """Along the whole rest of the path, and never far from it."""
    car = Car(Pose2())
    path = ScriptedPath(WAYPOINTS, lambda: car.pose)
    while not car.pose.y > 1.9:
        car.drive(path.predict()[0])
    car.pose, trace = put, [put]
    for _ in range(600):
        car.drive(path.predict()[0])
        trace.append(car.pose)
    off = [min(abs(p.y), abs(p.y - 2), abs(p.x - 3)) for p in trace]
    assert max(off) < 0.3
    ahead = WAYPOINTS[1 if put.y == 0.0 else 2 :]
    passed = [min(math.dist(w, p[:2]) for p in trace) for w in ahead]
    assert max(passed) < 0.12
    assert path.finished


def test_a_robot_that_is_carried_back_after_the_end_drives_on():
    car = Car(Pose2())
    path = ScriptedPath(WAYPOINTS[:2], lambda: car.pose)
    while not path.finished:
        car.drive(path.predict()[0])
    car.pose = Pose2(0.5, 0.0, 0.0)
    car.drive(path.predict()[0])
    assert not path.finished
    assert car.v > 0.0


def test_of_a_path_there_and_back_it_goes_on_with_the_present_leg():
    car = Car(Pose2())
    path = ScriptedPath(np.array([(0.0, 0), (4, 0), (0, 0)]), lambda: car.pose)
    while not (math.cos(car.pose.theta) < -0.9 and car.pose.x < 3.0):
        car.drive(path.predict()[0])
    car.pose = Pose2(1.5, 0.0, math.pi)
    for _ in range(30):
        car.drive(path.predict()[0])
    assert car.pose.x < 0.6


def test_a_robot_that_was_carried_goes_on_from_the_first_segment_near_it() -> None:
    place = [Pose2(0.5, 0.0, 0.0)]
    there_and_back = np.array([(0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (4.0, 0.04), (0.0, 0.04)])
    driver = ScriptedPath(there_and_back, lambda: place[0])
    driver.predict()
    place[0] = Pose2(4.0, 2.0, math.pi / 2)
    assert driver.predict()[0][0] > 0.0  # upwards, as on the first of the two ways
    place[0] = Pose2(1.0, 0.04, 0.0)
    assert driver.predict()[0][0] > 0.0  # not back along the last one, which ends here
    assert abs(driver.predict()[0][1]) < 0.3
