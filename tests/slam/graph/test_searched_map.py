import math

import numpy as np
import pytest

from slam.geometry import Array, Pose2, compose
from slam.graph.local_map import LocalMap
from slam.graph.searched_map import MAX_SHIFT, MOST_BENT, NEIGHBOURS, SearchedMap, _bent
from slam.graph.whole_map import WholeMap
from slam.maps.static import Static
from slam.sensor_models.endpoint import Endpoint
from tests.slam.worlds import loop, scan_at

ROOM = [Pose2.of(pose) for pose in loop(30)]
MOVED = Pose2(3.0, -2.0, 0.4)
ROOMS = 24  # far from each other, each with two local maps
APART = 2.0 * NEIGHBOURS


def local_map(k: int) -> LocalMap:
    result = LocalMap((), scan_at(ROOM[k], time=0.7 * k))
    for n in range(1, 4):
        result.add(scan_at(ROOM[k + n], time=0.7 * (k + n)), ROOM[k].between(ROOM[k + n]))
    return result


@pytest.fixture(scope="module")
def places() -> list[LocalMap]:
    return [local_map(k) for _ in range(ROOMS) for k in (0, 5)]


@pytest.fixture
def poses() -> Array:
    return np.array([(APART * n + ROOM[k].x, *ROOM[k][1:]) for n in range(ROOMS) for k in (0, 5)])


def value(endpoint: Endpoint, pose: Pose2) -> float:
    """Log-likelihood of a scan of the room."""
    return float(endpoint.log_likelihood(scan_at(ROOM[2]), np.array([pose]))[0])


def test_it_is_the_field_of_the_whole_map(places, poses) -> None:
    searched, places, poses = SearchedMap(), places[:6], poses[:6]
    for number in range(1, 6):
        searched.endpoint(places[:number], poses[:number])
    found = searched.endpoint(places, poses)
    whole = WholeMap(Static)
    whole.update(places, poses)
    expected = Endpoint()
    expected.refresh(whole.map_model, np.flatnonzero(whole.map_model.cells.observed.flat))
    one, other = (field.tiles.dense(field.field()) for field in (found, expected))
    np.testing.assert_allclose(one, other, atol=0.05)  # of what hardly changes it is not redone
    assert (one != other).mean() < 1e-3
    assert np.ptp(other) > 1.0


def test_what_moves_together_is_not_drawn_anew_and_poses_are_moved_into_it(places, poses) -> None:
    searched, here = SearchedMap(), ROOM[2]
    endpoint, pose = searched.around(places[:4], poses[:4], here)
    assert pose == pytest.approx(here)
    tiles, usual = endpoint.tiles, value(endpoint, pose)
    moved = compose(MOVED, poses)
    endpoint, pose = searched.around(places[:6], moved[:6], MOVED @ here)
    assert endpoint.tiles is tiles
    assert pose == pytest.approx(here)
    assert value(endpoint, pose) == pytest.approx(usual)
    there = Pose2(2.0 * APART + here.x, here.y, here.theta)  # a room that was drawn since
    assert value(endpoint, there) == pytest.approx(usual, abs=0.1)
    assert value(endpoint, MOVED @ here) < usual - 10.0


def test_it_is_drawn_anew_where_the_robot_is_or_much_of_it_lies_otherwise(places, poses) -> None:
    searched, here, far = SearchedMap(), ROOM[2], Pose2(APART + ROOM[2].x, *ROOM[2][1:])
    tiles = searched.around(places, poses, here)[0].tiles

    def drawn_anew(at: Pose2) -> bool:
        return searched.around(places, poses, at)[0].tiles is not tiles

    poses[1, 0] += 0.9 * MAX_SHIFT
    assert not drawn_anew(here)
    poses[1, 0] += 0.3 * MAX_SHIFT
    assert not drawn_anew(far)
    assert drawn_anew(here)
    tiles = searched.around(places, poses, here)[0].tiles
    for n in range(4, 4 + int(MOST_BENT * ROOMS)):
        poses[2 * n + 1, 2] += math.radians(1.2)
        assert not drawn_anew(here)
    poses[-1, 2] += math.radians(1.2)
    assert drawn_anew(here)


def test_where_nothing_is_drawn_a_pose_stays() -> None:
    assert SearchedMap().around([], np.zeros((0, 3)), MOVED)[1] == pytest.approx(MOVED)


@pytest.mark.parametrize("turned", [0, 1])
def test_a_turn_moves_what_is_far_from_it(turned: int) -> None:
    drawn = np.array([[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [-10.0, 0.0, 0.0]])
    for degrees, expected in ((0.3, False), (0.9, True)):
        poses = drawn.copy()
        poses[turned, 2] = math.radians(degrees)
        assert _bent(drawn, poses)[:2].tolist() == [expected, expected]
