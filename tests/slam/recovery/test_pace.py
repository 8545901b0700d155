"""Jumps of the odometry, by accelerations."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from agents import record_path
from dynslam_env import Slip
from slam.algorithms.maximum_likelihood import MaximumLikelihood
from slam.algorithms.particle_filter import ParticleFilter
from slam.errors import InputError
from slam.geometry import Pose2
from slam.recovery.pace import Pace, jumps
from slam.recovery.watch import Watch
from tests.slam.recovery.drawn_room import room

STEP = Pose2(0.1, 0.0, 0.02)  # of 0.1 s: 1 m/s, 0.2 rad/s


def driven(*last: Pose2, seconds: float = 0.1) -> list[bool]:
    """Whether the odometry jumped, at each of the last motions after 2 s of driving."""
    pace, time, told = Pace(), 0.0, []
    for k, motion in enumerate([*[STEP] * 20, *last]):
        time += seconds if k >= 20 else 0.1
        pace.move(motion, time)
        told.append(pace.expected is not None)
    assert not any(told[:20])
    return told[20:]


@pytest.mark.parametrize(
    "jump",
    [Pose2(0.9, 0.0, 0.0), Pose2(-0.7, 0.0, 0.0), Pose2(0.1, -0.8, 0.0), Pose2(0.1, 0.0, 1.5),
     Pose2(-30.0, 12.0, 2.0)],
)  # fmt: skip
def test_a_motion_that_no_robot_makes_is_a_jump(jump: Pose2) -> None:
    assert driven(jump, STEP, STEP) == [True, False, False]


@pytest.mark.parametrize("motion", [STEP, Pose2(), Pose2(0.25, 0.0, 0.0), Pose2(0.0, 0.0, 0.3)])
def test_a_start_a_stop_and_a_turn_are_none(motion: Pose2) -> None:
    assert not any(driven(*[motion] * 5))


def test_what_takes_long_is_none() -> None:
    """Scans are missing: the robot drove on, or turned."""
    assert driven(Pose2(0.8, 0.0, 0.0), seconds=1.0) == [False]
    assert driven(Pose2(0.0, 0.0, math.pi / 2), seconds=1.0) == [False]


@pytest.mark.parametrize("seconds", [0.25, 0.5, 1.0])
@pytest.mark.parametrize("speed", [1.0, 2.0, 3.0])
def test_a_recording_that_begins_in_motion_jumps_once_at_most(speed: float, seconds: float) -> None:
    pace, told = Pace(), []
    for k in range(20):
        pace.move(Pose2(speed * seconds, 0.0, 0.0), k * seconds)
        told.append(pace.expected is not None)
    assert not any(told[2:])


def test_the_jumps_of_a_recording_are_listed() -> None:
    at_ten = Slip(0.8, at=(10.0, 10.5), duration=0.1)
    smooth, jumping = (
        record_path("DoorCorridor-v0", 1, max_episode_steps=150, faults=faults)
        for faults in ((), (at_ten,))
    )
    assert jumps(smooth) == []
    (jump,) = jumps(jumping)
    assert 10.0 <= jump.time <= 10.7
    assert jump.distance == pytest.approx(0.8, abs=0.1)
    assert jump.turn == pytest.approx(0.0, abs=0.1)


def test_the_velocity_is_not_that_of_a_burst() -> None:
    """Scans in bursts, of which the stamps are a thousandth of a second apart (Intel)."""
    pace, time = Pace(), 0.0
    for k in range(400):
        time += 0.001 if k % 4 else 0.6
        pace.move(Pose2(0.12, 0.0, 0.0), time)
        assert pace.expected is None


@pytest.mark.parametrize("kind", [MaximumLikelihood, ParticleFilter])
@pytest.mark.parametrize("steps", [1, 3])
def test_a_displacement_that_is_refused_is_no_motion(
    kind: type[MaximumLikelihood | ParticleFilter], steps: int
) -> None:
    slam = kind(watch=Watch())
    assert slam.watch is not None
    time, told = 0.0, []
    for x in [0.1] * 10 + [math.nan] + [0.1] * steps + [0.9]:
        time += 0.1
        try:
            slam.update(Pose2(x, 0.0, 0.0), replace(room(), time=time))
        except InputError:
            assert math.isnan(x)
        told.append(slam.watch.pace.expected is not None)
    assert told == [False] * (11 + steps) + [True]


def test_stamps_that_do_not_increase_are_no_error() -> None:
    pace = Pace()
    pace.move(STEP, 1.0)
    pace.move(STEP, 1.0)
    pace.move(STEP, 0.5)
    assert pace.expected is None
