"""Wings at oblique angles, and generators with sliding doors."""

import json
import math
from itertools import pairwise

import numpy as np
import pytest

from dynslam_env import Corridor, Layout, Loop, Office, Varied, Wings
from dynslam_env.reset_options import DIFFICULTIES
from dynslam_env.worlds.clearance import leaf
from dynslam_env.worlds.start_checks import check_start
from slam import InputError
from tests.dynslam_env.worlds.driven import drive
from tests.dynslam_env.worlds.naive import along, distances, reached

SEEDS, FEW = range(10), range(3)
RADIUS = 0.22  # m, of the robot
MAKERS = (Corridor, Loop, Office)


def drawn(world, seed):
    return world.layout(np.random.default_rng(seed))


def turns(layout):
    """rad, by which the path turns at each waypoint on the way out."""
    there = layout.path[: len(layout.path) // 2 + 1]
    headings = [math.atan2(*(b - a)[::-1]) for a, b in pairwise(there)]
    return np.array([math.remainder(b - a, math.tau) for a, b in pairwise(headings)])


@pytest.mark.parametrize("world", [Wings(), *(Varied(Wings(), each) for each in DIFFICULTIES)])
def test_walls_close_ways_are_free_and_rooms_are_reached(world):
    for seed in SEEDS:
        layout = drawn(world, seed)
        check_start(layout, layout.start, RADIUS, math.pi / 2)
        ways = [along(leg.reshape(2, 2), 0.05) for leg in
                np.hstack([layout.path[:-1], layout.path[1:]])]  # fmt: skip
        assert distances(np.vstack(ways), layout.walls).min() > 0.5
        middles = [leaf(door, 0.0).reshape(-1, 2).mean(axis=0) for door in layout.doors]
        inside, leaks = reached(layout, np.vstack([layout.path, *middles, *layout.routes]))
        assert inside.all()
        assert not leaks


def test_bends_are_oblique_and_as_many_as_asked_for():
    found = []
    for seed in SEEDS:
        bends = turns(drawn(Wings(wings=4), seed))
        assert len(bends) == 3
        found += bends.tolist()
    assert math.radians(20) <= np.abs(found).min() < math.radians(35)
    assert math.radians(55) < np.abs(found).max() <= math.radians(65)
    assert min(found) < 0 < max(found)


def test_wings_have_hinged_double_and_sliding_doors():
    doors = [door for seed in SEEDS for door in drawn(Wings(), seed).doors]
    sliding = sum(door.slides for door in doors)
    narrow = sum(door.width < 0.5 for door in doors)
    assert 0.1 < sliding / len(doors) < 0.6
    assert 0.1 < narrow / len(doors) < 0.8


@pytest.mark.parametrize("maker", MAKERS)
def test_open_leaves_lie_within_walls(maker):
    """Nobody can get to where an open leaf is."""
    count = 0
    for seed in FEW:
        layout = drawn(maker(sliding=1.0, doubled=0.3), seed)
        points = []
        for door in (each for each in layout.doors if each.slides):
            count += 1
            c, s = math.cos(door.closed), math.sin(door.closed)
            shut = leaf(door, 0.0)
            assert leaf(door, math.pi / 2) == pytest.approx(
                shut - door.width * np.array([c, s] * 2)
            )
            points += [along(each.reshape(2, 2), 0.1) for each in leaf(door, math.pi / 2)]
        inside, _ = reached(layout, np.vstack(points))
        assert not inside.any()
    assert count > len(FEW)


@pytest.mark.parametrize("maker", MAKERS)
def test_without_sliding_doors_a_world_is_as_before(maker):
    one, none = drawn(maker(sliding=0.0), 3), drawn(maker(), 3)
    assert json.dumps(one.plain()) == json.dumps(none.plain())
    assert "slides" not in json.dumps(none.plain())


def test_a_world_file_keeps_sliding_doors(tmp_path):
    layout = drawn(Wings(), 0)
    layout.save(tmp_path / "wings.json")
    again = Layout.load(tmp_path / "wings.json")
    assert again.plain() == layout.plain()
    assert [door.slides for door in again.doors] == [door.slides for door in layout.doors]
    text = (tmp_path / "wings.json").read_text().replace('"slides": true', '"slides": 1', 1)
    (tmp_path / "wrong.json").write_text(text)
    with pytest.raises(InputError, match="slides must be true or false, got 1"):
        Layout.load(tmp_path / "wrong.json")


def test_wings_that_lie_over_each_other_are_told(monkeypatch):
    monkeypatch.setattr("dynslam_env.worlds.wings.MAX_TRIES", 1)
    world = Wings(12, Corridor(length=3.0, doors_per_side=1), 1.3, 1.3)
    with pytest.raises(InputError, match="some of 12 wings lay over each other"):
        [drawn(world, seed) for seed in SEEDS]


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"wings": 0}, "Wings.wings must be"),
        ({"least_bend": 2.0}, "Wings.least_bend must be"),
        ({"most_bend": 0.1}, "Wings.most_bend"),
        ({"corridor": Loop()}, "Wings.corridor must be"),
    ],
)
def test_wrong_parameters_are_refused(wrong, message):
    with pytest.raises(InputError, match=message):
        Wings(**wrong)


def test_wings_can_be_driven_to_the_end():
    arrived, touched = drive("DoorWings-v0", 0, difficulty="easy")
    assert arrived
    assert touched < 60
