import math

import numpy as np
import pytest

import dynslam_env
from dynslam_env import DoorCorridorEnv, Laser, Layout
from slam import InputError, Pose2

ROOM = [(0, 0, 6, 0), (6, 0, 7, 4), (7, 4, 1, 5), (1, 5, 0, 0)]
MOUNT = Pose2(0.15, -0.05, 0.3)


def env_in(walls, start, **laser):
    env = DoorCorridorEnv(
        world=Layout(np.array(walls), (), start, np.array([(3.0, 2.0)])), laser=Laser(**laser)
    )
    env.reset(seed=0)
    return env


@pytest.mark.parametrize("start", [Pose2(2.0, 2.0, 0.3), Pose2(4.5, 3.0, -2.0), Pose2(1.0, 1, 2.9)])
@pytest.mark.parametrize("mount", [Pose2(), MOUNT])
def test_the_bound_of_the_pose_is_that_of_finite_differences(start, mount):
    env = env_in(ROOM, start, beams=90, field_of_view=4.0, sigma=0.02, mount=mount)
    scanner, segments = env._fleet.scanners[0], env.physics.segments
    gradient, step = np.empty((90, 3)), 1e-6
    for k in range(3):
        ranges = []
        for sign in (1, -1):
            moved = np.array(start)
            moved[k] += sign * step
            ranges.append(scanner.exact(Pose2(*moved), segments))
        gradient[:, k] = (ranges[0] - ranges[1]) / (2 * step)
    expected = np.linalg.inv(gradient.T @ gradient / 0.02**2)
    assert env.bound().covariance == pytest.approx(expected, rel=1e-4, abs=1e-12)
    assert env.bound().std_x == pytest.approx(math.sqrt(expected[0, 0]), rel=1e-4)


def test_open_doors_tell_where_along_the_passage_the_robot_is():
    def median_bound(share):
        stds = []
        for seed in range(12):
            env = DoorCorridorEnv(doors=dynslam_env.Doors(dynslam_env.Static(), open_share=share))
            env.reset(seed=seed, options={"start": (4.0 + seed / 3, 0.0, 0.0)})
            stds.append(env.bound().std_x)
        return np.median(stds)

    assert median_bound(1.0) < 0.75 * median_bound(0.0) < 0.004


def test_along_an_endless_passage_there_is_no_bound():
    env = env_in([(-50, 1, 50, 1), (-50, -1, 50, -1)], Pose2())
    assert env.bound().std_x == math.inf
    assert env.bound().std_y < 0.01


def test_a_laser_without_noise_has_none():
    with pytest.raises(InputError, match="sigma must be a finite number above 0"):
        env_in(ROOM, Pose2(2, 2, 0), sigma=0.0).bound()


def test_nothing_in_reach_says_nothing():
    bound = env_in([(100, 0, 101, 0)], Pose2()).bound()
    assert bound.std_x == bound.std_y == bound.std_theta == math.inf


def test_a_beam_without_a_reading_says_nothing():
    def std(dropout):
        env = DoorCorridorEnv(laser=Laser(dropout=dropout))
        env.reset(seed=0)
        return env.bound().std_x

    assert std(0.0) < std(0.5) < std(1.0) == math.inf


def test_without_walls_and_doors_nothing_is_known():
    assert env_in(np.zeros((0, 4)), Pose2()).bound().std_x == math.inf
