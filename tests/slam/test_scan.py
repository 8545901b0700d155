import math
from typing import Any

import numpy as np
import pytest

from slam.errors import InputError
from slam.geometry import Pose2
from slam.scan import Scan

RANGES = np.array([1.0, 0.05, 0.0, -1.0, math.nan, math.inf, 4.9, 5.0, 6.0, -math.inf])


def test_every_kind_of_reading_is_an_echo_no_echo_or_nothing() -> None:
    scan = Scan(RANGES, np.zeros(10), max_range=5.0, min_range=0.1)
    assert np.flatnonzero(scan.hit).tolist() == [0, 6]
    assert np.flatnonzero(scan.no_echo).tolist() == [5, 7, 8]


def test_a_range_of_zero_is_no_echo_even_without_a_minimum() -> None:
    scan = Scan(RANGES, np.zeros(10), max_range=5.0)
    assert np.flatnonzero(scan.hit).tolist() == [0, 1, 6]


def test_points_lie_in_the_robots_frame() -> None:
    mount = Pose2(0.2, 0.1, math.pi / 2)
    ranges, angles = np.array([2.0, math.nan, 1.0]), np.array([0.0, 0.5, math.pi / 2])
    scan = Scan(ranges, angles, 5.0, mount=mount)
    np.testing.assert_allclose(scan.points, [[0.2, 2.1], [-0.8, 0.1]], atol=1e-12)
    assert scan.directions.shape == (3, 2)


def test_a_scan_without_echo_has_no_points() -> None:
    assert Scan(np.array([math.inf]), np.zeros(1), 5.0).points.shape == (0, 2)


@pytest.mark.parametrize(
    ("ranges", "angles"),
    [(np.ones(3), np.ones(2)), (np.ones((2, 2)), np.ones((2, 2))), (np.float64(1), np.float64(1))],
)
def test_other_shapes_are_refused(ranges, angles) -> None:
    with pytest.raises(InputError, match="one range and one angle per beam"):
        Scan(ranges, angles, 5.0)


@pytest.mark.parametrize(
    ("low", "high"), [(0.0, 0.0), (2.0, 1.0), (-0.1, 1.0), (math.nan, 1.0), (0.0, math.nan)]
)
def test_limits_that_hold_no_range_are_refused(low: float, high: float) -> None:
    with pytest.raises(InputError, match="min_range"):
        Scan(np.ones(1), np.zeros(1), max_range=high, min_range=low)


def test_a_bare_scan_is_the_same_without_what_was_computed_of_it() -> None:
    scan = Scan(RANGES, np.zeros(10), 5.0, 0.1, 7.0, Pose2(0.2, 0.1, 0.3), 0.001)
    points = scan.points
    bare = scan.bare()
    assert set(vars(bare)) == set(Scan.__dataclass_fields__) < set(vars(scan))
    assert all(getattr(bare, name) is getattr(scan, name) for name in vars(bare))
    np.testing.assert_array_equal(bare.points, points)


def test_a_reading_in_single_precision_at_the_maximum_is_no_echo() -> None:
    single: Any = np.full(3, 5.6, np.float32)
    scan = Scan(single, np.arange(3.0), 5.6)
    assert not scan.hit.any()
    assert scan.no_echo.all()


def test_directions_do_not_depend_on_the_scans_before() -> None:
    ranges, angles = np.ones(7), np.arange(7) / 4
    single: Any = angles.astype(np.float32)  # the same angles

    def expected(turn: float = 0.0) -> np.ndarray:
        return np.column_stack([np.cos(angles + turn), np.sin(angles + turn)])

    Scan(ranges, single, 5.0).directions.sum()
    np.testing.assert_array_equal(Scan(ranges, angles, 5.0).directions, expected())
    turned = Scan(ranges, angles, 5.0, mount=Pose2(0, 0, 0.5)).directions
    np.testing.assert_array_equal(turned, expected(0.5))
    np.testing.assert_array_equal(Scan(ranges, angles, 5.0).directions, expected())
    angles += 0.125  # in place
    np.testing.assert_array_equal(Scan(ranges, angles, 5.0).directions, expected())


def test_ranges_in_whole_numbers_are_compared_with_limits_that_are_none() -> None:
    scan = Scan(np.array([0, 1, 5, 6]), np.arange(4.0), max_range=5.5, min_range=0.5)
    assert scan.hit.tolist() == [False, True, True, False]
    assert scan.no_echo.tolist() == [False, False, False, True]


def test_a_limit_in_double_precision_is_that_of_readings_in_single_precision() -> None:
    single: Any = np.full(3, 5.7, np.float32)
    scan = Scan(single, np.arange(3.0), max_range=np.float64(5.7))
    assert not scan.hit.any()
    assert scan.no_echo.all()
