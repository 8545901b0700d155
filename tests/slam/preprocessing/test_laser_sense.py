from dataclasses import replace

import numpy as np
import pytest

from slam.episode import Episode
from slam.geometry import Pose2
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


def test_odometry_that_turns_where_the_robot_does_not_is_not_the_lasers_fault() -> None:
    """The drive of the paper: straight on, with 3 degrees of false turning each 5 cm."""
    from tests.slam.worlds import PAPERS_BIAS, scan_at

    times = np.arange(80) / 10
    poses = np.column_stack([np.linspace(-1.2, 2.2, 80), np.full(80, 0.2), np.zeros(80)])
    rng = np.random.default_rng(0)
    scans = [scan_at(Pose2.of(p), t, rng=rng) for p, t in zip(poses, times, strict=True)]
    turned = np.column_stack([poses[:, :2], PAPERS_BIAS * (poses[:, 0] - poses[0, 0])])
    assert sense_of(Episode(tuple(scans), Trajectory(times, turned))) is Sense.UPRIGHT


def test_without_odometry_or_turns_nothing_is_told(upright: Episode) -> None:
    still = Trajectory(upright.times, np.zeros((len(upright.scans), 3)))
    assert sense_of(replace(frozen(upright), odometry=still)) is Sense.UPRIGHT
    none = replace(turned_over(upright), meta={"odometry": ""})
    assert sense_of(none) is Sense.UPRIGHT
