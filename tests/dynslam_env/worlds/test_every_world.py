"""What holds in every world, whatever is drawn."""

import math
from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dynslam_env import Corridor, Loop, Office, Varied
from dynslam_env.worlds.start_checks import check_start
from slam import InputError
from tests.dynslam_env.naive import leaf
from tests.dynslam_env.worlds.naive import (
    ANGLES,
    along,
    covers,
    crossings,
    distances,
    reached,
    swept,
)

RADIUS = 0.22  # m, of the robot
PERSON = 0.2  # m
WORLDS = [
    Corridor(people=3),
    Loop(people=3),
    Office(),
    Office(furniture=3, people=4),
    Office(length=10.0, breadth=7.5, doors=1, furniture=2, people=2),
    Corridor(furniture=3, narrowest=0.7, cut=1.0, people=2),
    Varied(Corridor(), "medium"),
    Varied(Corridor(people=6), "hard"),
    Varied(Loop(), "medium"),
    Varied(Loop(), "hard"),
    Varied(Office(), "medium"),
    Varied(Office(), "hard"),
]

everywhere = pytest.mark.parametrize("world", WORLDS, ids=repr)
seeds = given(seed=st.integers(0, 2**32 - 1))
often = settings(max_examples=25)


def drawn(world, seed):
    return world.layout(np.random.default_rng(seed))


def legs(points):
    return np.hstack([points[:-1], points[1:]])


@everywhere
@seeds
@often
def test_walls_close_and_every_place_is_reached(world, seed):
    layout = drawn(world, seed)
    ajar = [leaf(door, door.closed + door.swing * math.pi / 4) for door in layout.doors]
    beyond_doors = np.array([outline[1, :2] for outline in ajar])
    inside, leaks = reached(layout, np.vstack([layout.path, beyond_doors, *layout.routes]))
    assert inside.all()
    assert not leaks


@everywhere
@seeds
@often
def test_no_wall_twice_and_none_without_length(world, seed):
    walls = drawn(world, seed).walls
    assert np.hypot(*(walls[:, 2:] - walls[:, :2]).T).min() > 1e-4  # cut corners may be that short
    ends = {tuple(sorted([(a, b), (c, d)])) for a, b, c, d in walls.tolist()}
    assert len(ends) == len(walls)


@everywhere
@seeds
@often
def test_leaves_swing_clear_of_walls_and_of_each_other(world, seed):
    layout = drawn(world, seed)
    for i, door in enumerate(layout.doors):
        outlines = np.array([leaf(door, door.closed + door.swing * angle) for angle in ANGLES])
        centres = np.tile(outlines[:, :, :2].mean(axis=1, keepdims=True), 2)
        shrunk = centres + (outlines - centres) * (1 - 1e-5)
        assert crossings(shrunk.reshape(-1, 4), layout.walls) == 0
        points = swept(door)
        for other in layout.doors[i + 1 :]:
            assert not covers(other, points).any()


@everywhere
@seeds
@often
def test_a_closed_leaf_fills_its_opening(world, seed):
    layout = drawn(world, seed)
    for door in layout.doors:
        outline = leaf(door, door.closed)
        assert distances(outline[:2, :2], layout.walls) == pytest.approx([0.0, 0.002], abs=1e-9)


@everywhere
@seeds
@often
def test_start_and_path_are_clear_of_walls_and_leaves(world, seed):
    layout = drawn(world, seed)
    check_start(layout, layout.start, RADIUS, math.pi / 2)
    assert layout.path[0].tolist() == layout.path[-1].tolist() == list(layout.start[:2])
    way = along(layout.path)
    assert distances(way, layout.walls).min() > RADIUS + 0.1
    for door in layout.doors:
        assert not covers(door, way, RADIUS + 0.1).any()


@everywhere
@seeds
@often
def test_people_pass_through_doorways_only_and_wait_out_of_reach_of_leaves(world, seed):
    layout = drawn(world, seed)
    if not isinstance(world, Varied):
        assert len(layout.routes) == world.people
    for route in layout.routes:
        assert distances(along(route), layout.walls).min() > PERSON
        for door in layout.doors:
            assert not covers(door, route, PERSON).any()


@everywhere
@seeds
@often
def test_people_cross_a_doors_leaf_in_its_middle_or_keep_away(world, seed):
    layout = drawn(world, seed)
    for route in layout.routes:
        for leg in legs(route):
            way = along(leg.reshape(2, 2))
            for door in layout.doors:
                shut = leaf(door, door.closed)[:1]
                if crossings(leg[None], shut):
                    middle = shut[0].reshape(2, 2).mean(axis=0)
                    assert distances(middle[None], leg[None])[0] < 0.01
                else:
                    assert not covers(door, way, PERSON).any()


@everywhere
@seeds
@often
def test_people_begin_apart(world, seed):
    layout = drawn(world, seed)
    begun = [layout.start[:2], *(route[0] for route in layout.routes)]
    for i, place in enumerate(begun):
        assert all(math.dist(place, other) >= 0.6 for other in begun[i + 1 :])


@everywhere
def test_same_seed_same_layout_and_another_seed_another(world):
    first, second, other = drawn(world, 3), drawn(world, 3), drawn(world, 4)
    assert first.plain() == second.plain()
    assert first.plain() != other.plain()


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, "much", True])
@pytest.mark.parametrize("world", [Corridor(), Loop(), Office()], ids=repr)
def test_settings_are_finite_numbers(world, value):
    for field in fields(world):
        with pytest.raises(InputError, match=rf"{type(world).__name__}\.{field.name} must be"):
            replace(world, **{field.name: value})
