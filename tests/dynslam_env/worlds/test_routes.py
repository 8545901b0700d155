from itertools import permutations

import numpy as np
import pytest

from dynslam_env.worlds.clearance import edges
from dynslam_env.worlds.floor_plan import Doorway, FloorPlan
from dynslam_env.worlds.outline import Rect
from dynslam_env.worlds.routes import RoutePlanner, draw_routes, waiting_point
from slam import InputError

# 2 3   four rooms around a corner where four walls meet;
# 0 1   0-1 is a door that opens into 1, all others are open
ROOMS = (Rect(0, 0, 4, 4), Rect(4.2, 0, 8.2, 4), Rect(0, 4.2, 4, 8.2), Rect(4.2, 4.2, 8.2, 8.2))
DOORWAYS = (
    Doorway((0, 1), 0.5, 0.9, 1),
    Doorway((0, 2), 2.5, 0.9),
    Doorway((2, 3), 5.0, 0.9),
    Doorway((3, 1), 7.0, 0.9),
)
PLAN = FloorPlan(ROOMS, DOORWAYS)


def box(left, bottom, right, top):
    return edges(np.array([(left, bottom), (right, bottom), (right, top), (left, top)]))


def test_waiting_points():
    assert waiting_point(PLAN, (0, 0)) == pytest.approx((4.1 - 0.7, 0.95))
    assert waiting_point(PLAN, (0, 1)) == pytest.approx((4.1 + 1.3, 0.95))  # out of its reach
    assert waiting_point(PLAN, (1, 2)) == pytest.approx((2.95, 4.1 + 0.7))


def test_the_way_to_the_next_room_is_straight():
    assert np.array(RoutePlanner(PLAN).route(0, 1)) == pytest.approx(
        np.array([(3.4, 0.95), (5.4, 0.95)])
    )


@pytest.mark.parametrize("doorways", list(permutations(DOORWAYS)))
def test_the_shorter_of_two_ways_around_is_taken(doorways):
    planner = RoutePlanner(FloorPlan(ROOMS, doorways))
    way = np.array(planner.route(0, 3))
    expected = [(2.95, 3.4), (2.95, 4.8), (3.4, 5.45), (4.8, 5.45)]
    assert way == pytest.approx(np.array(expected))
    assert planner.route(3, 0) == [tuple(point) for point in way[::-1].tolist()]


def test_where_something_stands_in_the_way_it_is_the_other_one():
    blocked = RoutePlanner(PLAN, [(2, box(2.0, 4.3, 3.9, 4.6))])
    assert np.array(blocked.route(0, 3))[0] == pytest.approx(np.array([3.4, 0.95]))
    assert np.array(blocked.route(0, 3))[-1] == pytest.approx(np.array([7.45, 4.8]))


def test_and_where_all_is_blocked_there_is_none():
    blocked = RoutePlanner(PLAN, [(2, box(2.0, 4.3, 3.9, 4.6)), (1, box(5.0, 3.0, 8.0, 3.2))])
    assert blocked.route(0, 3) == []


def test_nobody_walks_where_another_doors_leaf_swings():
    spaces = (Rect(0, 0, 6, 4), Rect(0, 4.2, 2.9, 8), Rect(3.1, 4.2, 6, 8), Rect(6.2, 0, 9, 4))
    shut = Doorway((0, 2), 4.0, 0.9, 2)
    into = shut._replace(opens_to=0)
    for door, free in ((shut, True), (into, False)):
        plan = FloorPlan(spaces, (Doorway((0, 1), 1.0, 0.9), Doorway((0, 3), 2.9, 0.9), door))
        assert bool(RoutePlanner(plan).route(1, 3)) is free


@pytest.mark.parametrize("seed", range(20))
def test_routes_lead_from_a_room_to_another(seed):
    routes = draw_routes(PLAN, range(4), 4, np.random.default_rng(seed), (1.0, 1.0))
    assert len(routes) == 4
    for route in routes:
        first, last = (room(point) for point in (route[0], route[-1]))
        assert None not in (first, last)
        assert first != last


def room(point):
    for i, (left, bottom, right, top) in enumerate(ROOMS):
        if left < point[0] < right and bottom < point[1] < top:
            return i
    return None


def test_rooms_too_small_for_people_are_refused():
    spaces = (Rect(0, 0, 4, 4), Rect(0, 4.2, 4, 5.5))
    plan = FloorPlan(spaces, (Doorway((0, 1), 1.0, 0.9, 1),))
    with pytest.raises(InputError, match="make rooms wider, or take fewer people"):
        draw_routes(plan, range(2), 1, np.random.default_rng(0), (0.0, 0.0))
    assert draw_routes(plan, range(2), 0, np.random.default_rng(0), (0.0, 0.0)) == ()
