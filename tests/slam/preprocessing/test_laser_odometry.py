"""Laser odometry: odometry from the scans alone."""

import math

import numpy as np

from slam.episode import Episode
from slam.geometry import between
from slam.preprocessing.laser_odometry import ConstantVelocity, poses_by_laser, with_odometry
from slam.trajectory import Trajectory
from tests.slam.worlds import drive


def blind(episode: Episode) -> Episode:
    still = Trajectory(episode.times, np.zeros((len(episode.scans), 3)))
    return Episode(episode.scans, still, episode.truth, {"odometry": ""})


def test_follows_a_drive_around_a_room():
    episode = blind(drive(n=100))
    assert not episode.has_odometry
    made = with_odometry(episode, list(poses_by_laser(episode)))
    assert made.has_odometry
    assert episode.truth is not None
    truth = between(episode.truth.poses[0], episode.truth.poses)
    error = between(truth, made.odometry.poses)
    assert np.hypot(error[:, 0], error[:, 1]).max() < 0.08
    assert np.abs(error[:, 2]).max() < math.radians(2.0)


def test_stamps_that_jitter_are_not_taken_for_speed():
    episode = blind(drive(n=100))
    rng = np.random.default_rng(0)
    times = np.sort(episode.times + rng.uniform(0, 0.0999, 100))
    times[50] = times[49] + 1e-6
    scans = tuple(
        type(scan)(scan.ranges, scan.angles, scan.max_range, time=time)
        for scan, time in zip(episode.scans, times.tolist(), strict=True)
    )
    poses = np.array(list(poses_by_laser(Episode(scans, Trajectory(times, np.zeros((100, 3)))))))
    assert episode.truth is not None
    error = between(between(episode.truth.poses[0], episode.truth.poses), poses)
    assert np.hypot(error[:, 0], error[:, 1]).max() < 0.1


def test_is_less_sure_after_a_longer_time():
    displacement = ConstantVelocity()
    short, long = displacement.deviations(0.05), displacement.deviations(0.5)
    assert (long > 2 * short).all()
    assert np.allclose(displacement.deviations(0.0), [0.03, 0.03, math.radians(1.5)])
