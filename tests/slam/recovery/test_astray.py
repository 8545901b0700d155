"""A robot that is found at no place of the map goes on on new ground, and elsewhere stays lost."""

from dataclasses import replace

import numpy as np
import pytest

from slam.algorithms.dead_reckoning import DeadReckoning
from slam.geometry import Pose2
from slam.interface import Estimate
from slam.recovery.astray import NEW_GROUND, SUDDEN, Astray, Demands
from slam.recovery.places import Places, Surroundings
from slam.scan import Scan
from tests.slam.recovery.drawn_room import reading, room

BESIDE = Pose2(6.0, 0.0, 0.0)  # the known room, 4 x 3 m around the origin
STEP = Pose2(0.2, 0.0, 0.0)


class Turning(DeadReckoning):
    """A SLAM of a robot that comes back to where it stood: only the odometry tells of the way."""

    def update(self, displacement: Pose2, scan: Scan) -> Estimate:
        return Estimate(Pose2(), np.zeros((3, 3)), 0.0, True)


def driven(demands: Demands) -> tuple[Astray, float]:
    """A robot in a room like the known one, which has two places for each scan, that believes to be
    beside it; and after how many metres it went on, infinite if it did not."""
    astray = Astray(Turning(), Surroundings(reading(), Pose2()), BESIDE, 0.95, demands)
    for k in range(round(2.0 * NEW_GROUND / STEP.x)):
        scan = replace(room(), time=float(k))
        astray.update(STEP, scan)
        if astray.found(scan.time) is not None:
            return astray, (k + 1) * STEP.x
    return astray, np.inf


def test_it_goes_on_on_new_ground_and_is_not_sure() -> None:
    astray, metres = driven(SUDDEN)
    assert metres == pytest.approx(NEW_GROUND, abs=1.0)
    assert not astray.sure
    assert np.sqrt(astray.covariance[0, 0]) > 0.3


def test_it_stays_lost_where_known_ground_did_not_agree_with_it() -> None:
    assert driven(SUDDEN._replace(no_new_ground=True))[1] == np.inf


def test_a_place_that_is_being_confirmed_comes_before_new_ground() -> None:
    astray = Astray(Turning(), Surroundings(reading(), Pose2()), BESIDE, 0.95)
    there = astray._places.matched(room(), Pose2())
    found, origin = iter([None] * 10 + [there] * 10), None
    astray._place = lambda scan, believed: (next(found), 5)
    for k in range(15):
        scan = replace(room(), time=2.0 * k)
        astray.update(Pose2(0.95, 0.0, 0.0), scan)
        origin = astray.found(scan.time)
        if origin is not None:
            break
    assert astray.sure
    assert origin == there.pose


def test_a_path_through_a_wall_is_told_from_one_on_new_ground() -> None:
    places = Places(reading(), known=True)
    inside, through, beyond = [[-1.5, 0.3], [1.5, -0.3]], [[0.0, 0.0], [4.0, 0.1]], [[3, 0], [9, 4]]
    assert not places.crossed(np.array(inside))
    assert places.crossed(np.array(through))
    assert not places.crossed(np.array(beyond, np.float64))
    assert not places.crossed(np.zeros((1, 2)))
