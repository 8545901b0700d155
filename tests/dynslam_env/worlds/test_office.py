import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from dynslam_env import Office
from dynslam_env.worlds.office_floor import FloorDimensions, draw_floor
from dynslam_env.worlds.outline import Rect
from slam import InputError
from tests.dynslam_env.worlds.driven import drive
from tests.dynslam_env.worlds.naive import along, covers, distances

SIZES = FloorDimensions(Rect(0.0, 0.0, 16.0, 11.0), 2.8, 0.9, 0.04, 0.2, 0.25, 0.47)
SEEDS = range(60)


def drawn(seed, **parameters):
    return Office(**parameters).layout(np.random.default_rng(seed))


@cache
def floors():
    found = (draw_floor(SIZES, np.random.default_rng(seed)) for seed in SEEDS)
    return tuple(floor for floor in found if floor)


def test_nearly_all_floors_can_be_used():
    assert len(floors()) > 0.9 * len(SEEDS)


def test_rooms_are_of_sensible_size_and_walls_between_them_as_thick_as_was_said():
    for plan, _ in floors():
        for left, bottom, right, top in plan.spaces:
            sides = sorted((right - left, top - bottom))
            assert sides[0] + 1e-9 >= 2.8
            assert sides[1] < 9.0
        for doorway in plan.doorways:
            wall = plan.wall(doorway)
            assert wall.high - wall.low == pytest.approx(0.2)


def test_doorways_without_a_leaf_join_all_rooms():
    for plan, _ in floors():
        joined = [{0}]
        for _ in plan.spaces:
            for doorway in plan.doorways:
                if doorway.opens_to is None and joined[0] & set(doorway.spaces):
                    joined[0] |= set(doorway.spaces)
        assert len(joined[0]) == len(plan.spaces)
        assert sum(each.opens_to is None for each in plan.doorways) == len(plan.spaces) - 1


def test_most_other_neighbours_have_a_door():
    ratios = [len(plan.doors) / len(plan.spaces) for plan, _ in floors()]
    assert np.median(ratios) > 0.5


def test_the_tour_comes_through_every_room():
    for plan, path in floors():
        for left, bottom, right, top in plan.spaces:
            x, y = path.T
            assert ((left < x) & (x < right) & (bottom < y) & (y < top)).any()


def test_no_leg_of_the_tour_is_too_short_to_steer_on():
    for _, path in floors():
        assert np.hypot(*np.diff(path, axis=0).T).min() > 0.75


@pytest.mark.parametrize("seed", range(40))
def test_as_many_doors_as_asked_for(seed):
    assert len(drawn(seed).doors) == 5
    for doors in (0, 2, 7):
        assert len(drawn(seed, doors=doors).doors) == doors


def test_another_floor_in_each_episode_unless_a_floor_is_named():
    rng = np.random.default_rng(0)
    assert Office().layout(rng).plain() != Office().layout(rng).plain()
    named = Office(floor=5)
    assert named.layout(rng).plain() == named.layout(rng).plain()
    assert named.layout(rng).plain() != replace(named, floor=6).layout(rng).plain()


def test_on_a_named_floor_the_furniture_alone_moves():
    rng, world = np.random.default_rng(0), Office(floor=5, furniture=2)
    first, second = world.layout(rng), world.layout(rng)
    bare = replace(world, furniture=0).layout(rng)
    count = len(bare.walls)
    assert len(first.walls) > count + 4 * 5
    assert first.walls[:count].tolist() == second.walls[:count].tolist() == bare.walls.tolist()
    assert first.walls[count:].tolist() != second.walls[count:].tolist()
    assert (first.doors, first.start) == (second.doors, second.start) == (bare.doors, bare.start)
    assert first.path.tolist() == second.path.tolist() == bare.path.tolist()


@pytest.mark.parametrize("seed", range(10))
def test_furniture_and_people_change_nothing_else(seed):
    bare, furnished = drawn(seed), drawn(seed, furniture=2)
    full = drawn(seed, furniture=2, people=4)
    assert replace(full, routes=()).plain() == furnished.plain()
    assert replace(furnished, walls=bare.walls).plain() == bare.plain()


@pytest.mark.parametrize("seed", range(30))
def test_furniture_stands_out_of_the_way(seed):
    bare, full = drawn(seed), drawn(seed, furniture=3, people=4)
    pieces = full.walls[len(bare.walls) :].reshape(-1, 4, 4)
    assert len(pieces) > 15
    ways = along(full.path)
    for i, piece in enumerate(pieces):
        sides = np.hypot(*(piece[:, 2:] - piece[:, :2]).T)
        assert sides[:2].tolist() == pytest.approx(sides[2:].tolist())
        assert 0.4 - 1e-9 <= sides.min() <= sides.max() <= 1.2 + 1e-9
        assert piece[:, 2:].tolist() == np.roll(piece, -1, axis=0)[:, :2].tolist()  # closed
        assert distances(ways, piece).min() >= 0.47 - 0.001
        outline = along(np.vstack([piece[:, :2], piece[:1, :2]]))
        assert distances(outline, bare.walls).min() >= 0.03 - 1e-9
        for other in pieces[i + 1 :]:
            assert distances(outline, other).min() >= 0.1 - 0.001
        for door in full.doors:
            assert not covers(door, outline, 0.05).any()
            assert distances(through(door), piece).min() > 0.44


def through(door):
    """(n, 2) points of the way through a doorway, to 0.7 m on either side, m."""
    c, s = math.cos(door.closed), math.sin(door.closed)
    middle = door.hinge + door.width / 2 * np.array([c, s])
    step = 0.7 * np.array([-s, c])
    return along(np.array([middle - step, middle + step]))


def test_no_piece_of_furniture_is_in_another():
    for seed in range(20):
        bare, full = drawn(seed), drawn(seed, furniture=6)
        centres = full.walls[len(bare.walls) :].reshape(-1, 4, 4)[:, :, :2].mean(axis=1)
        gaps = np.linalg.norm(centres[:, None] - centres, axis=-1) + np.eye(len(centres)) * 9
        assert gaps.min() > 0.4


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"length": 5.0, "breadth": 5.0}, r"need a floor of 5.8 x 2.8 m, Office has 5 x 5 m"),
        ({"breadth": 2.0}, "need a floor"),
        ({"room_side": 1.3}, "Office.room_side must be at least 1.4 m"),
        ({"furniture": -1}, "Office.furniture"),
        ({"furniture": 1.5}, "Office.furniture"),
        ({"floor": -1}, "Office.floor must be a whole number of at least 0"),
        ({"floor": "ground"}, "Office.floor"),
        ({"people": 1, "room_side": 1.5}, "at least 1.6 m deep"),
        ({"door_thickness": 0.3}, "Office.door_thickness"),
        ({"doors": None}, "Office.doors"),
        ({"free_way": math.nan}, "Office.free_way"),
    ],
)
def test_wrong_parameters_are_refused(wrong, message):
    with pytest.raises(InputError, match=message):
        Office(**wrong)


def test_more_doors_than_any_floor_has_are_refused():
    with pytest.raises(InputError, match=r"none of 100 floors .* had Office.doors = 60 doors"):
        drawn(0, doors=60)


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("parameters", [{}, {"world": Office(furniture=3)}], ids=repr)
def test_a_scripted_drive_is_completed_without_touching_anything(seed, parameters):
    assert drive("DoorOffice-v0", seed, **parameters) == (True, 0)
