"""Rotation between two scans."""

import math

import numpy as np
import pytest

from slam.geometry import Pose2
from slam.preprocessing.scan_rotation import contour, rotation
from slam.scan import Scan
from tests.slam.worlds import scan_at

FAN = np.radians(np.arange(-90, 91, 1.0))


@pytest.mark.parametrize("degrees", [-12.0, -3.0, 0.0, 0.5, 7.0, 15.0])
def test_is_that_of_the_sensor(degrees: float):
    rng = np.random.default_rng(0)
    before = Pose2(0.4, 0.1, 0.3)
    after = before @ Pose2(0.06, 0.01, math.radians(degrees))
    first, second = (scan_at(pose, angles=FAN, rng=rng) for pose in (before, after))
    assert math.degrees(rotation(contour(first), contour(second))) == pytest.approx(
        degrees, abs=0.2
    )


def test_beams_may_run_clockwise_and_all_around():
    fan = np.radians(np.arange(0, -360, -1.0))
    first, second = (
        scan_at(pose, angles=fan) for pose in (Pose2(0.4, 0.1, 3.0), Pose2(0.4, 0.1, 3.1))
    )
    assert rotation(contour(first), contour(second)) == pytest.approx(0.1, abs=2e-3)


def test_scans_of_different_places_do_not_match():
    near = scan_at(Pose2(0.4, 0.1, 0.3), angles=FAN)
    far = scan_at(Pose2(-20.0, 0.1, 0.3), angles=FAN, walls=np.array([[-19.0, -9, -19.0, 9]]))
    assert math.isnan(rotation(contour(near), contour(far)))


def test_a_scan_without_echoes_matches_nothing():
    blind = Scan(np.full(181, np.inf), FAN, 6.0)
    assert math.isnan(rotation(contour(blind), contour(blind)))
