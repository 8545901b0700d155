import math

import numpy as np
import pytest

from slam.geometry import Pose2
from slam.maps.outline import LINE, MAX_GAP, NOTHING, POINT, outline, outlined
from tests.slam import naive
from tests.slam.worlds import FAN, loop, scan_at


def points_at(pose: Pose2, walls, step_deg=1.0) -> np.ndarray:
    angles = np.radians(np.arange(-90, 90.5, step_deg))
    return scan_at(pose, angles=angles, walls=np.array(walls)).points


@pytest.mark.parametrize("seed", range(4))
def test_lines_and_kinds_are_those_of_the_plain_fit(seed: int) -> None:
    rng = np.random.default_rng(seed)
    for pose in loop(12):
        scan = scan_at(Pose2.of(pose), angles=FAN, rng=rng)
        keep = rng.random(len(scan.points)) < 0.9
        points = scan.points[keep]
        found = outline(points)
        tangents, kind = naive.outline(points)
        np.testing.assert_array_equal(found.kind, kind)
        along = np.abs((found.tangents * tangents).sum(axis=1))
        np.testing.assert_allclose(along[kind == LINE], 1.0, atol=1e-9)
        assert not found.tangents[kind != LINE].any()
        assert {LINE, POINT} <= set(kind.tolist())


def test_a_wall_at_a_grazing_angle_is_a_line_though_its_echoes_lie_far_apart() -> None:
    points = points_at(Pose2(), [[0.0, 1.0, 6.0, 1.0]])
    gaps = np.hypot(*np.diff(points, axis=0).T)
    found = outline(points)
    far = np.flatnonzero((gaps[1:] > 0.25) & (gaps[:-1] < MAX_GAP) & (gaps[1:] < MAX_GAP)) + 1
    far = np.append(far, np.flatnonzero((gaps[:-1] > 0.25) & (gaps[:-1] < MAX_GAP)) + 1)
    far = far[(far > 0) & (far < len(points) - 1)]
    assert len(far) >= 2
    assert (found.kind[far] == LINE).sum() >= len(far) - 2
    lines = found.tangents[found.kind == LINE]
    assert np.abs(lines[:, 0]).min() == pytest.approx(1.0, abs=1e-6)


def test_echoes_next_to_a_corner_have_the_direction_of_their_own_wall() -> None:
    points = points_at(Pose2(), [[1.0, -0.6, 1.0, 0.7], [1.0, 0.7, -0.5, 0.7]])
    found = outline(points)
    apart = np.hypot(*(points - (1.0, 0.7)).T) > 0.02  # the corner itself is of both walls
    on_side = np.isclose(points[:, 1], 0.7)
    assert (found.kind == LINE).all()
    assert np.abs(found.tangents[apart & on_side][:, 0]).min() > 0.99
    assert np.abs(found.tangents[apart & ~on_side][:, 1]).min() > 0.99


def test_a_post_is_a_point_and_a_lone_echo_behind_it_is_nothing() -> None:
    bearings = np.radians([20.0, 10.0, 0.0, -10.0, -20.0])
    post = np.array([5.0, 4.0, 2.0, 4.0, 5.0])
    points = post[:, None] * np.column_stack([np.cos(bearings), np.sin(bearings)])
    assert outline(points).kind.tolist() == [NOTHING, NOTHING, POINT, NOTHING, NOTHING]


@pytest.mark.parametrize("n", [0, 1, 2])
def test_a_few_echoes_are_no_line(n: int) -> None:
    points = np.array([(1.0, 0.05 * k) for k in range(n)], dtype=np.float64).reshape(n, 2)
    assert (outline(points).kind != LINE).all()
    assert outline(points).tangents.shape == (n, 2)


def test_a_rough_surface_is_no_line() -> None:
    y = np.arange(0.0, 1.0, 0.03, dtype=np.float64)
    points = np.array([(2.0 + 0.06 * (k % 2), away) for k, away in enumerate(y)])
    assert (outline(points).kind == POINT).all()
    smooth = outline(np.column_stack([np.full(len(y), 2.0), y]))
    assert (smooth.kind == LINE).all()
    assert math.isclose(abs(smooth.tangents[5, 1]), 1.0)


def test_the_outline_of_a_scan_is_kept_with_it() -> None:
    scan = scan_at(Pose2(0.3, 0.2, 1.0))
    kept = outlined(scan)
    assert outlined(scan) is kept
    assert kept.points is scan.points
    for found, expected in zip(kept, outline(scan.points), strict=True):
        np.testing.assert_array_equal(found, expected)
    assert outlined(scan.bare()) is not kept
