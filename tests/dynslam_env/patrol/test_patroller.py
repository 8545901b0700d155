import math
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import dynslam_env  # noqa: F401 - registers the ids
from dynslam_env.patrol.memory import DynamicMap
from dynslam_env.patrol.patroller import Patroller
from slam import Estimate, Pose2

from .drawn import wall


class Noting(DynamicMap):
    """Notes when it looked, and from where."""

    def __init__(self) -> None:
        super().__init__()
        self.looks: list[tuple[float, Pose2]] = []

    def look(self, scan, pose):
        self.looks.append((scan.time, pose))
        return super().look(scan, pose)


def patroller(found: Pose2) -> tuple[Patroller, Noting]:
    """A robot whose SLAM skipped a scan half way and then found it at a pose."""
    memory = Noting()
    robot = Patroller(Estimate(Pose2(), np.eye(3), 0.0, True), wall(2.0), memory)
    robot.move(Pose2(0.1, 0.0, 0.2), False)
    robot.skip(wall(2.0, 0.2))
    robot.move(Pose2(0.1, 0.0, 0.2), False)
    robot.look(Estimate(found, np.eye(3), 0.0, True), wall(2.0, 0.4))
    return robot, memory


def test_a_scan_that_the_slam_skipped_is_seen_between_two_estimates():
    odometry = Pose2(0.1, 0.0, 0.2) @ Pose2(0.1, 0.0, 0.2)
    _, memory = patroller(odometry @ Pose2(0.0, 0.0, 0.06))
    (_, (time, skipped), (_, last)) = memory.looks
    assert time == 0.2
    assert skipped == pytest.approx((0.1, 0.0, 0.23))
    assert last.theta == pytest.approx(0.46)


@pytest.mark.parametrize("elsewhere", [Pose2(5.0, 0.0, 0.0), Pose2(0.2, 0.02, 2.0)])
def test_a_pose_that_was_set_elsewhere_tells_nothing_of_a_skipped_scan(elsewhere):
    robot, memory = patroller(elsewhere)
    assert [time for time, _ in memory.looks] == [0.0, 0.4]
    robot.look(Estimate(elsewhere, np.eye(3), 0.0, True), wall(2.0, 0.8))
    assert [time for time, _ in memory.looks] == [0.0, 0.4, 0.8]


@pytest.mark.parametrize("scan_every", [1, 2, 4])
def test_the_dynamic_map_takes_at_least_each_second_scan(scan_every):
    env: Any = gym.make("DoorPatrol-v0", scan_every=scan_every, memory=Noting, slam="odometry")
    env.reset(seed=1)
    for _ in range(3):
        env.step(np.array([0.5, 0.3], np.float32))
    times = [time for time, _ in env.unwrapped.patroller.memory.looks]
    assert np.diff(times) == pytest.approx(0.1 * min(scan_every, 2))


def test_a_skipped_scan_lies_where_it_was_taken():
    env: Any = gym.make("DoorPatrol-v0", scan_every=4, memory=Noting, slam="static-ml")
    env.reset(seed=1)
    patrol: Any = env.unwrapped
    truth: dict[int, Pose2] = {}
    step = patrol.wrapped.step

    def noted(command):
        result = step(command)
        truth[round(10 * patrol.place.scan.time)] = patrol.place.pose
        return result

    patrol.wrapped.step = noted
    for _ in range(50):
        env.step(np.array([0.3, 0.6], np.float32))  # round in a circle
    looks = [(round(10 * time), pose) for time, pose in patrol.patroller.memory.looks[1:]]
    off = [Pose2.of(truth[k]).between(pose) for k, pose in looks if k % 4]
    assert len(off) == 50
    assert max(abs(theta) for _, _, theta in off) < 0.02
    assert max(math.hypot(x, y) for x, y, _ in off) < 0.015
    assert math.sqrt(np.mean([x * x + y * y for x, y, _ in off])) < 0.006
