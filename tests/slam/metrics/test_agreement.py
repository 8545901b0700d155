"""The agreement of walls: by hand, and on the log and the trajectory of another SLAM."""

import math

import numpy as np
import pytest

from slam.episode import Episode
from slam.io.formats import read_log
from slam.io.tum import read_tum
from slam.metrics.agreement import STRETCH, agreement
from slam.scan import Scan
from slam.trajectory import Trajectory

SCANS = 3 * STRETCH


def before_a_wall(ranges=(2.0, math.inf, 20.0)) -> Episode:
    """The robot stands still; one echo at 2 m ahead, no echo, and one too far away to count."""
    times = np.arange(float(SCANS))
    given = np.array(ranges)
    scans = tuple(Scan(given, np.array([0.0, 0.5, 1.0]), 30.0, time=t) for t in times)
    return Episode(scans, Trajectory(times, np.zeros((SCANS, 3))))


@pytest.mark.parametrize(
    ("apart", "expected"), [(0.0, 1.0), (0.04, 1.0), (0.06, 0.0), (0.49, 0.0), (0.6, math.nan)]
)
def test_a_wall_that_the_second_stretch_sees_elsewhere(apart, expected):
    poses = np.zeros((SCANS, 3))
    poses[STRETCH : 2 * STRETCH, 0] = apart
    assert agreement(before_a_wall(), poses) == pytest.approx(expected, nan_ok=True)


def test_half_of_the_stretches_agree():
    """The third stretch is off by 0.2 m: its echoes are near to one and close to none, and the
    other two agree with one another."""
    poses = np.zeros((SCANS, 3))
    poses[2 * STRETCH :, 1] = 0.2
    assert agreement(before_a_wall(), poses) == pytest.approx(2 / 3)


def test_without_echoes_it_is_unknown():
    assert math.isnan(agreement(before_a_wall((math.inf, math.inf, 20.0)), np.zeros((SCANS, 3))))


def test_no_frame_matters_and_a_turned_pose_does():
    poses = np.zeros((SCANS, 3))
    assert agreement(before_a_wall(), poses + (3.0, -2.0, 1.0)) == 1.0
    poses[STRETCH : 2 * STRETCH, 2] = 0.1  # 0.2 m at a range of 2 m
    assert agreement(before_a_wall(), poses) == 0.0


def test_gmapping_on_edmonton_scores_what_a_script_of_its_own_found(shared_data):
    """0.587, by a script that shares no code with dynslam (see the README of the data)."""
    episode = read_log(shared_data / "edmonton.log.gz").episode
    reference = read_tum(shared_data / "edmonton.reference.tum")
    assert agreement(episode, reference.at(episode.times)) == pytest.approx(0.587, abs=5e-4)
