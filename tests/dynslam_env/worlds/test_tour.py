import numpy as np
import pytest

from dynslam_env.worlds.floor_plan import Doorway, FloorPlan
from dynslam_env.worlds.outline import Rect
from dynslam_env.worlds.tour import tour

# 2      two doorways of room 0: one in its upper wall, one in its right wall
# 0 1
SPACES = (Rect(0, 0, 4, 4), Rect(4.2, 0, 8.2, 4), Rect(0, 4.2, 4, 8.2))
APART = FloorPlan(SPACES, (Doorway((0, 1), 0.5, 0.9), Doorway((0, 2), 0.5, 0.9)))
NEAR = FloorPlan(SPACES, (Doorway((0, 1), 2.7, 0.9), Doorway((0, 2), 2.7, 0.9)))


def test_from_the_root_into_every_room_and_back():
    expected = [(2, 2), (3.4, 0.95), (4.8, 0.95), (6.2, 2), (4.8, 0.95), (3.4, 0.95)]
    expected += [(0.95, 3.4), (0.95, 4.8), (2, 6.2), (0.95, 4.8), (0.95, 3.4), (2, 2)]
    assert np.array(tour(APART, 0)) == pytest.approx(np.array(expected))


def test_from_the_end_of_the_tree():
    way = np.array(tour(APART, 2))
    expected = [(2, 6.2), (0.95, 4.8), (0.95, 3.4), (3.4, 0.95), (4.8, 0.95), (6.2, 2)]
    assert way[:6] == pytest.approx(np.array(expected))
    assert way[::-1] == pytest.approx(way)


def test_two_doorways_at_one_corner_are_one_turn():
    way = np.array(tour(NEAR, 2))
    expected = [(2, 6.2), (3.15, 4.8), (3.15, 3.15), (4.8, 3.15), (6.2, 2)]
    assert way[:5] == pytest.approx(np.array(expected))
    assert way[::-1] == pytest.approx(way)
    there, back = np.array(tour(NEAR, 0)), np.array(tour(NEAR, 1))
    assert [3.15, 3.15] in there.round(9).tolist()
    assert [3.15, 3.15] in back.round(9).tolist()
