"""`bound` is never below the likelihood within reach, for every sensor model."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slam.geometry import Pose2
from slam.maps.static import Static
from slam.scan import Scan
from slam.sensor_models.beam import Beam
from slam.sensor_models.endpoint import Endpoint
from slam.sensor_models.literal import Literal
from tests.slam.sensor_models.rooms import mapped
from tests.slam.worlds import FAN, MAX_RANGE, scan_at

GRID = Static()
READINGS = {r: mapped(GRID, r(), noise=0.01)[1] for r in (Endpoint,)} | {
    r: mapped(Static(), r(), noise=0.01)[1] for r in (Beam, Literal)
}
REACHES = [0.001, 0.035, 0.05, 0.0707, 0.12, 0.3]
near = st.floats(-1.0, 1.0)
heading = st.integers(-314, 314).map(lambda hundredth: hundredth / 100)
far = st.floats(-20.0, 20.0)


@pytest.mark.parametrize("reading", READINGS)
@given(x=near, y=near, theta=heading, reach=st.sampled_from(REACHES), seed=st.integers(0, 999))
@settings(max_examples=60, derandomize=True)
def test_no_pose_within_reach_is_above_the_bound(reading, x, y, theta, reach, seed) -> None:
    assert_bounded(READINGS[reading], scan_at(Pose2(0.2, 0.1, theta)), (x, y, theta), reach, seed)


@given(x=far, y=far, theta=heading, reach=st.sampled_from(REACHES), seed=st.integers(0, 999))
@settings(max_examples=60, derandomize=True)
def test_nor_about_the_borders_of_the_map_and_its_tiles(x, y, theta, reach, seed) -> None:
    ranges = np.random.default_rng(seed).uniform(0.1, MAX_RANGE - 0.1, len(FAN))
    scan = Scan(ranges, FAN, MAX_RANGE)
    assert_bounded(READINGS[Endpoint], scan, (x, y, theta), reach, seed)
    left, bottom = GRID.cells.tiles.origin
    size = 3.2 * np.array(GRID.cells.tiles.index.shape[::-1])
    on_border = left + size[0] * (seed % 2), bottom + size[1] * (seed // 2 % 2), theta
    assert_bounded(READINGS[Endpoint], scan, on_border, reach, seed)


def assert_bounded(reading, scan, pose, reach: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    errors = np.column_stack([rng.uniform(-reach, reach, (40, 2)), np.zeros(40)])
    errors[:4, :2] = np.array([(1, 1), (1, -1), (-1, 1), (-1, -1)]) * reach
    errors[4] = 0
    values = reading.log_likelihood(scan, np.array(pose) + errors)
    assert values.max() <= reading.bound(scan, np.array([pose]), reach)[0] + 1e-4


@pytest.mark.parametrize("turned", [0.35, -0.35, 2.0])
@pytest.mark.parametrize("reach", [0.03, 0.07])
def test_a_wrong_heading_is_seen_from_the_bound(turned: float, reach: float) -> None:
    endpoint, truth = READINGS[Endpoint], Pose2(0.2, 0.1, 0.5)
    scan = scan_at(truth)
    best = endpoint.log_likelihood(scan, np.array([truth]))[0]
    wrong = np.array([[truth.x, truth.y, truth.theta + turned]])
    assert endpoint.bound(scan, wrong, reach)[0] < best - 3
    assert best <= endpoint.bound(scan, np.array([truth]), reach)[0]


def test_the_bound_grows_with_the_reach() -> None:
    endpoint, scan = READINGS[Endpoint], scan_at(Pose2(0.2, 0.1, 0.5))
    poses = np.random.default_rng(0).normal(0, 0.5, (20, 3))
    bounds = np.array([endpoint.bound(scan, poses, reach) for reach in REACHES])
    assert (np.diff(bounds, axis=0) >= 0).all()
    assert (bounds[-1] > bounds[0]).all()


def test_bounds_are_the_same_whenever_they_are_asked_for_first() -> None:
    grid, early, late = Static(), Endpoint(), Endpoint()
    scan, near = scan_at(Pose2(0.2, 0.1, 0.5)), np.random.default_rng(0).normal(0, 2, (50, 3))
    for k in range(6):
        changed = grid.integrate(scan_at(Pose2(0.1 * k, 0.1, 0.5), time=k), Pose2(0.1 * k, 0.1))
        for reading in (early, late):
            reading.refresh(grid, changed)
        early.bound(scan, near, 0.1)
    np.testing.assert_array_equal(early.bound(scan, near, 0.1), late.bound(scan, near, 0.1))


def test_no_echo_anywhere_is_above_its_bound() -> None:
    """One beam, all over the map: where the field is constant, the bound is tight."""
    endpoint, tiles = READINGS[Endpoint], GRID.cells.tiles
    rows, cols = tiles.spec.shape
    x, y = np.meshgrid(np.arange(1.0, cols - 1, 1.5), np.arange(1.0, rows - 1, 1.5))
    echoes = np.column_stack([x.ravel(), y.ravel()]) * 0.05 + tiles.origin
    poses = np.column_stack([echoes - (1.0, 0.0), np.zeros(len(echoes))])
    scan = Scan(np.array([1.0]), np.zeros(1), MAX_RANGE)
    values = endpoint.log_likelihood(scan, poses)
    assert (endpoint.bound(scan, poses, 0.001) >= values - 1e-5).all()
