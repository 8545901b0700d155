import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dynslam_env import Corridor
from dynslam_env.simulation.polygons import Polygons, regular
from tests.dynslam_env import naive

TRIANGLE = np.array([(0.0, 0.0), (2.0, 0.0), (0.0, 1.0)])


def outline(shapes, poses):
    polygons = Polygons(shapes)
    edges = np.full((polygons.count, 4), np.nan)
    polygons.outline(np.array(poses, dtype=np.float64).reshape(-1, 3), edges)
    return edges


def areas(edges):
    """Twice the area that edges enclose, positive for counter-clockwise."""
    return (edges[:, 0] * edges[:, 3] - edges[:, 2] * edges[:, 1]).sum()


def test_a_triangle_by_hand():
    edges = outline([TRIANGLE], [(10.0, 5.0, math.pi / 2)])
    assert edges == pytest.approx(np.array([(10, 5, 10, 7), (10, 7, 9, 5), (9, 5, 10, 5)]))


def test_clockwise_corners_are_turned_around_and_the_first_edge_stays():
    edges = outline([TRIANGLE[::-1]], [(0.0, 0.0, 0.0)])
    assert areas(edges) == pytest.approx(2.0)
    assert {tuple(e) for e in edges[0].reshape(2, 2)} == {(0.0, 1.0), (2.0, 0.0)}


@settings(max_examples=100, derandomize=True)
@given(st.lists(st.integers(3, 9), max_size=5), st.integers(0, 99))
def test_edges_close_turn_left_and_stay_with_their_bodies(corners, seed):
    rng = np.random.default_rng(seed)
    shapes = [regular(rng.uniform(0.1, 2), k)[:: rng.choice([-1, 1])] for k in corners]
    poses = rng.uniform(-4, 4, (len(shapes), 3))
    edges = outline(shapes, poses)
    for shape, pose in zip(shapes, poses, strict=True):
        mine, edges = edges[: len(shape)], edges[len(shape) :]
        assert mine[:, 2:] == pytest.approx(np.roll(mine[:, :2], -1, axis=0))
        assert areas(mine - np.tile(pose[:2], 2)) > 0
        radii = np.linalg.norm(mine[:, :2] - pose[:2], axis=1)
        assert radii == pytest.approx(np.linalg.norm(shape, axis=1))
    assert not len(edges)


def test_leaves_agree_with_the_naive_reference():
    doors = Corridor().layout(np.random.default_rng(0)).doors
    angles = np.random.default_rng(1).uniform(-4, 4, len(doors))
    poses = [(*door.hinge, angle) for door, angle in zip(doors, angles, strict=True)]
    edges = outline([door.corners for door in doors], poses).reshape(-1, 4, 4)
    for mine, door, angle in zip(edges, doors, angles, strict=True):
        assert ends(mine) == ends(naive.leaf(door, angle))
        assert ends(mine[:1]) == ends(naive.leaf(door, angle)[:1])  # along the leaf at the hinge


def ends(edges):
    """Edges without their directions."""
    return {frozenset({(round(a, 9), round(b, 9)), (round(c, 9), round(d, 9))})
            for a, b, c, d in edges.tolist()}  # fmt: skip


def test_a_regular_polygon_has_equal_sides_within_its_circle():
    octagon = regular(0.2, 8)
    assert np.linalg.norm(octagon, axis=1) == pytest.approx(0.2)
    sides = np.linalg.norm(np.roll(octagon, -1, axis=0) - octagon, axis=1)
    assert sides == pytest.approx(2 * 0.2 * math.sin(math.pi / 8))


def test_no_polygons_no_edges():
    assert outline([], []).shape == (0, 4)
