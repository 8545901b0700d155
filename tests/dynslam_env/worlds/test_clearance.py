import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from dynslam_env import Door
from dynslam_env.worlds.clearance import (
    any_crossing,
    clear,
    clear_of_legs,
    edges,
    farther,
    first_crossed,
    gap,
    inside,
    leaf,
    legs,
    sweep,
)
from tests.dynslam_env import naive

numbers = st.floats(-3.0, 3.0)
segments = st.tuples(numbers, numbers, numbers, numbers)
doors = st.builds(
    Door,
    st.tuples(numbers, numbers),
    st.floats(-4.0, 4.0),
    st.sampled_from([1, -1]),
    st.floats(0.3, 1.5),
    st.floats(0.01, 0.2),
    slides=st.just(False),
)
SQUARE = edges(np.array([(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0)]))


def sampled(segment, count=400):
    a, b = np.array(segment).reshape(2, 2)
    return a + np.linspace(0, 1, count)[:, None] * (b - a)


@given(segments, segments)
def test_gap_is_the_distance_of_the_nearest_points(a, b):
    found = gap(np.array([a]), np.array([b]))
    nearest = np.linalg.norm(sampled(a)[:, None] - sampled(b), axis=-1).min()
    spacing = (math.dist(a[:2], a[2:]) + math.dist(b[:2], b[2:])) / 399
    assert found <= nearest + 1e-9
    assert nearest <= found + spacing + 1e-9


@given(st.lists(segments, min_size=1, max_size=4), st.lists(segments, min_size=1, max_size=4))
def test_gap_of_many_is_the_least(these, those):
    pairs = [gap(np.array([a]), np.array([b])) for a in these for b in those]
    assert gap(np.array(these), np.array(those)) == min(pairs)
    assert gap(np.array(those), np.array(these)) == pytest.approx(min(pairs), abs=1e-12)


@given(numbers, numbers, st.floats(0.0, 6.3))
def test_inside_of_a_square(x, y, turn):
    assume(min(abs(abs(x) - 1), abs(abs(y) - 1)) > 1e-6)
    c, s = math.cos(turn), math.sin(turn)
    corners = np.array([(1, 1), (-1, 1), (-1, -1), (1, -1)]) @ np.array([(c, s), (-s, c)])
    expected = abs(x) < 1 and abs(y) < 1
    assert inside(edges(corners), c * x - s * y, s * x + c * y) == expected


@given(doors, st.floats(0.0, math.pi / 2))
def test_leaf_is_the_naive_one(door, angle):
    expected = naive.leaf(door, door.closed + door.swing * angle)
    assert leaf(door, angle) == pytest.approx(expected, abs=1e-9)


@given(doors, st.floats(0.2, math.pi / 2))
def test_a_sweep_holds_the_leaf_at_every_angle_and_little_more(door, angle):
    outline = sweep(door, angle)
    for opened in np.linspace(0, angle, 30):
        centre = leaf(door, opened)[:, :2].mean(axis=0)
        for x, y in leaf(door, opened)[:, :2] * (1 - 1e-6) + centre * 1e-6:
            assert inside(outline, x, y) or gap(np.array([(x, y, x, y)]), outline) < 1e-6
    reach = np.hypot(*(outline[:, :2] - door.hinge).T).max()
    assert reach < 1.02 * math.hypot(door.width, door.thickness)


def test_clear_sees_what_is_inside():
    small = edges(np.array([(0.9, 0.9), (1.1, 0.9), (1.1, 1.1), (0.9, 1.1)]))
    assert gap(small, SQUARE) == pytest.approx(0.9)
    assert not clear(small, SQUARE, 0.1)
    assert not clear(SQUARE, small, 0.1)
    assert clear(small + 3.0, SQUARE, 0.1)
    assert not clear(small + 3.0, SQUARE, 3.0)


def test_clear_of_legs():
    assert not clear_of_legs(SQUARE, legs(np.array([(-1.0, 1.0), (3.0, 1.0)])), 0.1)  # through
    assert not clear_of_legs(SQUARE, legs(np.array([(0.8, 1.0), (1.2, 1.0)])), 0.1)  # inside
    beside = legs(np.array([(2.5, -1.0), (2.5, 3.0), (2.5, 9.0)]))
    assert clear_of_legs(SQUARE, beside, 0.5)
    assert not clear_of_legs(SQUARE, beside, 0.51)
    assert clear_of_legs(SQUARE, legs(np.array([(1.0, 1.0)])), 1.0)  # a way without legs


@given(
    st.lists(segments, min_size=1, max_size=5),
    st.lists(segments, min_size=1, max_size=5),
    st.floats(0.0, 3.0),
)
def test_farther_compares_the_gap(these, those, distance):
    one, other = np.array(these), np.array(those)
    assume(abs(gap(one, other) - distance) > 1e-9)
    assert farther(one, other, distance) == (gap(one, other) >= distance)


@given(st.lists(segments, max_size=6), st.lists(segments, max_size=6))
def test_the_first_segment_that_is_crossed(these, those):
    one, other = np.array(these).reshape(-1, 4), np.array(those).reshape(-1, 4)
    expected = [
        next((j for j in range(len(other)) if any_crossing(each[None], other[j : j + 1])), -1)
        for each in one
    ]
    assert first_crossed(one, other).tolist() == expected
