import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slam.geometry import Pose2, transform_points
from slam.graph.local_map import PANORAMA_CELL, PANORAMA_SIZE, Keyframe, LocalMap, panorama
from slam.scan import Scan
from tests.slam.worlds import FAN, beam, scan_at

seeds = st.integers(0, 2**32 - 1)


def random_map(rng, n: int) -> LocalMap:
    place = LocalMap((), beam(1.0, 0.0))
    for k in range(1, n):
        place.add(beam(1.0 + k, float(k)), Pose2.of(rng.normal(0, 1, 3)))
    return place


@settings(max_examples=30)
@given(seeds, st.integers(1, 6), st.integers(0, 9))
def test_seeds_of_the_next_lie_where_they_lay(seed: int, n: int, seeds: int) -> None:
    """Twice, so that seeds become seeds again."""
    rng = np.random.default_rng(seed)
    place = random_map(rng, n)
    before = [(one.scan, one.pose) for one in place]
    frame = Pose2()
    for time in (100.0, 200.0):
        pose = Pose2.of(rng.normal(0, 2, 3))
        scan = beam(2.0, time)
        following = place.following(scan, pose, seeds)
        frame = frame @ pose
        expected = before[max(len(before) - seeds, 0) :]
        assert len(following.seeds) == len(expected)
        for one, (known, where) in zip(following.seeds, expected, strict=True):
            assert one.scan is known
            assert tuple(where.between(frame @ one.pose)) == pytest.approx((0, 0, 0), abs=1e-9)
        assert [(one.scan, one.pose) for one in following.keyframes] == [(scan, Pose2())]
        assert following.length == 0.0
        assert [one.scan for one in following] == [one for one, _ in expected] + [scan]
        before = [*expected, (scan, frame)]
        place = following


def test_the_way_is_that_of_its_own_keyframes() -> None:
    place = LocalMap((), beam(1.0)).following(beam(1.0), Pose2(5.0, 5.0, 1.0), 3)
    for pose in (Pose2(3.0, 4.0, 1.0), Pose2(3.0, 4.0, 2.0), Pose2(3.0, 2.0, 0.0)):
        place.add(beam(1.0), pose)
    assert place.length == pytest.approx(7.0)
    assert place.middle() == pytest.approx((9 / 4, 10 / 4, 0.0))


@pytest.mark.parametrize("step", [0.05, 0.1, 0.7, 2.0])
def test_its_path_is_thinned_out_evenly(step: float) -> None:
    place = LocalMap((), beam(1.0))
    assert place.path().tolist() == [[0, 0, 0]]
    own = [Pose2()]
    while place.length < 4.0:
        own.append(own[-1] @ Pose2(step, 0.0, 0.1 * step))
        place.add(beam(1.0), own[-1])
    path = place.path()
    assert path[[0, -1]].tolist() == [list(own[0]), list(own[-1])]
    assert {tuple(pose) for pose in path.tolist()} <= {tuple(pose) for pose in own}
    steps = np.hypot(*np.diff(path, axis=0)[:, :2].T)
    assert steps.max() <= max(step, 0.4 + step) + 1e-9
    assert len(path) <= 12


def test_a_compact_one_is_drawn_in_the_same_way() -> None:
    place = LocalMap((), scan_at(Pose2())).following(scan_at(Pose2(0.3)), Pose2(0.3), 1)
    place.add(scan_at(Pose2(0.6)), Pose2(0.3))
    before, seen = place.keyframes, place.panorama()
    assert any("points" in vars(one.scan) for one in before)
    place.compact()
    assert place.seeds == ()
    assert place.ordinal == 1
    assert not any("points" in vars(one.scan) for one in place.keyframes)
    assert [one.pose for one in place.keyframes] == [one.pose for one in before]
    np.testing.assert_array_equal(place.panorama().ranges, seen.ranges)


@settings(max_examples=20)
@given(seeds, st.integers(1, 5))
def test_a_panorama_is_what_its_own_keyframes_saw_thinned_out(seed: int, n: int) -> None:
    rng = np.random.default_rng(seed)
    place = LocalMap((), scan_at(Pose2())).following(scan_at(Pose2(0.3)), Pose2(0.3), 1)
    for _ in range(1, n):
        pose = Pose2.of(rng.normal(0, 0.3, 3))
        mount = Pose2(0.1, 0.05, 0.2)
        place.add(scan_at(Pose2(0.3) @ pose, mount=mount), pose)
    every = [transform_points(one.pose, one.scan.points) for one in place.keyframes]
    points, found = np.concatenate(every), place.panorama()
    off = np.abs(found.points[:, None] - points).max(axis=2)
    assert off.min(axis=1).max() < 1e-9
    squares = {tuple(square) for square in np.floor(points / PANORAMA_CELL).astype(int).tolist()}
    chosen = points[off.argmin(axis=1)]
    taken = [tuple(square) for square in np.floor(chosen / PANORAMA_CELL).astype(int).tolist()]
    assert len(set(taken)) == len(taken) == min(len(squares), PANORAMA_SIZE)
    assert found.hit.all()
    assert found.mount == Pose2()


def test_a_panorama_of_much_keeps_of_all_around() -> None:
    rng, place = np.random.default_rng(0), LocalMap((), scan_at(Pose2()))
    for _ in range(10):
        place.add(Scan(rng.uniform(1.0, 5.0, 360), np.linspace(-3, 3, 360), 6.0), Pose2())
    found = place.panorama().points
    assert len(found) == PANORAMA_SIZE
    every = np.concatenate([one.scan.points for one in place.keyframes])
    for low in np.arange(-4.0, 4.0, 0.5):
        share, kept = (
            ((points[:, 0] >= low) & (points[:, 0] < low + 0.5)).mean() for points in (every, found)
        )
        assert kept == pytest.approx(share, abs=0.03)


@pytest.mark.parametrize("fill", [math.nan, math.inf, 0.0])
def test_a_panorama_of_nothing_has_no_points(fill: float) -> None:
    place = LocalMap((), Scan(np.full(len(FAN), fill), FAN, 6.0))
    place.add(Scan(np.full(len(FAN), fill), FAN, 6.0), Pose2(0.1))
    assert place.panorama().points.shape == (0, 2)
    assert len(LocalMap((), scan_at(Pose2())).panorama().points) > 50


def test_a_panorama_knows_from_where_each_echo_was_seen() -> None:
    mount = Pose2(0.2, 0.1, 0.3)
    poses = [Pose2(), Pose2(1.0, -0.5, 2.0)]
    seen = [Keyframe(scan_at(pose, mount=mount), pose) for pose in poses]
    found = panorama(seen)
    assert len(found.views) == len(found.points) > 100
    eyes = np.array([(pose @ mount)[:2] for pose in poses])
    away = found.points[:, None] - eyes
    along = np.abs(np.einsum("nkd,nd->nk", away, found.views) - np.hypot(*away.transpose(2, 0, 1)))
    assert along.min(axis=1).max() < 1e-9
    assert {0, 1} == set(along.argmin(axis=1).tolist())
    np.testing.assert_array_equal(found.bare().views, found.views)
