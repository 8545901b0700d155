import numpy as np
import pytest

from dynslam_env.drawing.free_space import free_space


def box(left, bottom, right, top):
    return [
        (left, bottom, right, bottom),
        (right, bottom, right, top),
        (right, top, left, top),
        (left, top, left, bottom),
    ]


def area(ring):
    x, y = ring.T
    return (x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2


def free_area(walls, at):
    free = free_space(np.array(walls, dtype=np.float64), at)
    assert free.outer is not None
    return area(free.outer) + sum(area(hole) for hole in free.holes)


def test_a_room():
    assert free_area(box(0, 0, 4, 3), (1, 1)) == pytest.approx(12)


def test_a_block_in_a_room_is_a_hole_and_what_is_in_it_is_of_no_account():
    walls = box(0, 0, 10, 8) + box(3, 3, 5, 6)
    assert free_area(walls, (1, 1)) == pytest.approx(80 - 6)
    shelved = walls + [(3, 4, 5, 4), (3.5, 3.2, 4, 3.4)]
    assert free_area(shelved, (1, 1)) == pytest.approx(80 - 6)


def test_furniture_against_a_wall_is_cut_out():
    assert free_area(box(0, 0, 10, 8) + box(0, 6, 1, 8), (5, 5)) == pytest.approx(80 - 2)


def test_a_wall_that_ends_in_a_room_takes_nothing():
    assert free_area(box(0, 0, 10, 8) + [(5, 0, 5, 3), (2, 6, 4, 7)], (1, 1)) == pytest.approx(80)


def test_a_room_without_a_door_is_not_free_and_one_with_an_opening_is():
    apart = box(0, 0, 4, 3) + box(4, 0, 8, 3)
    assert free_area(apart, (1, 1)) == pytest.approx(12)
    open_plan = [*box(0, 0, 8, 3), (4, 0, 4, 1), (4, 2, 4, 3)]
    assert free_area(open_plan, (1, 1)) == pytest.approx(24)


def test_corners_that_nearly_meet_do():
    gap = 0.004
    walls = [(0, 0, 4, 0), (4, gap, 4, 3), (4, 3 + gap, 0, 3), (-gap, 3, 0, gap)]
    assert free_area(walls, (1, 1)) == pytest.approx(12, abs=0.05)


def test_walls_drawn_twice_and_in_pieces_are_one():
    walls = box(0, 0, 4, 3) + box(0, 0, 4, 3) + [(0, 0, 1.5, 0), (1, 0, 4, 0)]
    assert free_area(walls, (1, 1)) == pytest.approx(12)


def test_out_of_doors_there_is_no_end_and_buildings_are_solid():
    free = free_space(np.array(box(0, 0, 4, 3) + box(6, 0, 8, 3), dtype=np.float64), (5.0, 1.0))
    assert free.outer is None
    assert sorted(round(area(hole)) for hole in free.holes) == [-12, -6]


def test_no_walls():
    free = free_space(np.empty((0, 4)), (0.0, 0.0))
    assert free.outer is None
    assert free.holes == []
