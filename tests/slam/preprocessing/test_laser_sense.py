from dataclasses import replace

import numpy as np
import pytest

from slam.episode import Episode
from slam.preprocessing.laser_sense import Sense, sense_of, turned_over
from slam.trajectory import Trajectory
from tests.slam.worlds import drive


@pytest.fixture(scope="module")
def upright() -> Episode:
    return drive(n=150, bias=0.02)


def frozen(episode: Episode) -> Episode:
    """As from a driver that repeats its first scan."""
    first = episode.scans[0]
    return replace(episode, scans=tuple(replace(first, time=one.time) for one in episode.scans))


def test_a_laser_that_turns_with_the_robot_is_upright(upright: Episode) -> None:
    assert sense_of(upright) is Sense.UPRIGHT


def test_a_laser_that_is_upside_down_is_recognised_and_turned_over(upright: Episode) -> None:
    upside_down = turned_over(upright)
    assert sense_of(upside_down) is Sense.MIRRORED
    mended = turned_over(upside_down)
    assert all(
        np.array_equal(a.angles, b.angles) for a, b in zip(mended.scans, upright.scans, strict=True)
    )


def test_a_laser_that_stands_still_is_recognised(upright: Episode) -> None:
    assert sense_of(frozen(upright)) is Sense.STILL
    noise = np.random.default_rng(0)
    standing = [
        replace(scan, ranges=scan.ranges + noise.normal(0, 0.005, len(scan.ranges)))
        for scan in frozen(upright).scans
    ]
    assert sense_of(replace(upright, scans=tuple(standing))) is Sense.STILL


def test_a_stuck_laser_is_recognised_on_a_straight_drive(upright: Episode) -> None:
    times = upright.times
    straight = np.column_stack([times, np.zeros((len(times), 2))])
    stuck = replace(frozen(upright), odometry=Trajectory(times, straight))
    assert sense_of(stuck) is Sense.STILL
    assert sense_of(replace(upright, odometry=stuck.odometry)) is Sense.UPRIGHT  # nobody can tell


def test_without_odometry_or_turns_nothing_is_told(upright: Episode) -> None:
    still = Trajectory(upright.times, np.zeros((len(upright.scans), 3)))
    assert sense_of(replace(frozen(upright), odometry=still)) is Sense.UPRIGHT
    none = replace(turned_over(upright), meta={"odometry": ""})
    assert sense_of(none) is Sense.UPRIGHT
