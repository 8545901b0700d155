"""Worlds of a difficulty: they vary, they are valid, and they can be driven."""

import math
from collections import Counter
from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from dynslam_env import Corridor, DoorWorldEnv, Layout, Loop, Office, People, Varied
from dynslam_env.reset_options import DIFFICULTIES
from dynslam_env.simulation.people import Walkers
from dynslam_env.splits import SplitEpisode
from dynslam_env.worlds.clearance import leaf
from dynslam_env.worlds.floor_plan import Doorway, FloorPlan
from dynslam_env.worlds.layout import LATCH_GAP
from dynslam_env.worlds.outline import Rect
from dynslam_env.worlds.plan_variety import Stands, narrowed
from dynslam_env.worlds.start_checks import check_people, check_start
from dynslam_env.worlds.varied import at_difficulty
from slam import InputError
from tests.dynslam_env.worlds.driven import drive
from tests.dynslam_env.worlds.naive import distances

KINDS = (Corridor(), Loop(), Office())
COUNT = 100  # worlds of each kind and difficulty
RADIUS = 0.22  # m, of the robot

each = pytest.mark.parametrize(
    "world",
    [Varied(kind, level) for kind in KINDS for level in DIFFICULTIES],
    ids=lambda world: f"{type(world.world).__name__}-{world.difficulty}",
)


@cache
def layout_of(world, index):
    return world.layout(SplitEpisode("test", index).rng())


def drawn(world, count=COUNT):
    return [layout_of(world, i) for i in range(count)]


@each
def test_a_hundred_worlds_are_valid(world):
    """Starts are free, closed leaves begin at a jamb and end at one or at another leaf, people's
    routes are clear."""
    for layout in drawn(world):
        check_start(layout, layout.start, RADIUS, math.pi / 2)
        starts = np.array([route[0] for route in layout.routes]).reshape(-1, 2)
        check_people(layout, starts, 0.2, RADIUS)
        for door in layout.doors:
            ends = leaf(door, 0.0)[:2, :2]
            hinged, shut = distances(ends, layout.walls)
            others = [np.linalg.norm(ends[1] - free_edge(each)) for each in layout.doors
                      if each is not door]  # fmt: skip
            assert hinged == pytest.approx(0.0, abs=1e-9)
            assert min(shut, min(others, default=1.0) / 2) == pytest.approx(LATCH_GAP, abs=1e-9)


@each
def test_worlds_vary_in_size_and_in_number_of_doors(world):
    layouts = drawn(world)
    lengths = [np.hypot(*(x.walls[:, 2:] - x.walls[:, :2]).T).sum() for x in layouts]
    assert max(lengths) > 1.2 * min(lengths)
    doors = Counter(len(layout.doors) for layout in layouts)
    assert len(doors) >= 2
    assert max(doors.values()) < 0.8 * COUNT
    widths = {door.width for layout in layouts for door in layout.doors}
    assert max(widths) > 1.08 * min(widths)


def test_a_harder_world_is_larger_and_has_more_doors_people_and_walls():
    for kind in KINDS:
        means = []
        for level in DIFFICULTIES:
            layouts = drawn(Varied(kind, level), 40)
            lengths = [np.hypot(*np.diff(x.path, axis=0).T).sum() for x in layouts]
            counts = [(len(x.doors), len(x.routes), len(x.walls)) for x in layouts]
            means.append([np.mean(lengths), *np.mean(counts, axis=0)])
        for easier, harder in pairwise(means):
            assert all(a < b for a, b in zip(easier, harder, strict=True)), (kind, means)


def test_hard_worlds_have_walls_at_many_angles_and_oblique_corners():
    def angles(layout):
        x, y = (layout.walls[:, 2:] - layout.walls[:, :2]).T
        return np.arctan2(y, x)

    for kind in KINDS:
        layouts = drawn(Varied(kind, "hard"), 20)
        axes = {round(angles(layout)[0] % (math.pi / 2), 3) for layout in layouts}
        assert len(axes) > 15  # the floors are turned
        for layout in layouts:
            turned = (angles(layout) - angles(layout)[0]) % (math.pi / 2)
            oblique = np.minimum(turned, math.pi / 2 - turned) > 0.05
            assert oblique.any()


def test_people_of_the_world_are_kept():
    for level, added in (("easy", (0, 0)), ("medium", (0, 2)), ("hard", (2, 4))):
        counts = [len(layout.routes) - 6 for layout in drawn(Varied(Corridor(people=6), level), 20)]
        assert added[0] <= min(counts) <= max(counts) <= added[1]


@pytest.mark.parametrize(
    "name", ["DoorCorridor-v0", "DoorLoop-v0", "DoorOffice-v0", "DoorCrowd-v0"]
)
def test_a_hard_world_can_be_driven_to_the_end(name):
    for seed in range(2):
        arrived, _ = drive(name, seed, difficulty="hard")
        assert arrived, (name, seed)


def test_ranges_that_never_fit_are_told():
    with pytest.raises(InputError, match=r"50 draws of Varied.* gave no world; the last one: "):
        Varied(Corridor(clearance=3.0, length=80.0), "hard").layout(np.random.default_rng(0))


def test_other_worlds_and_levels_are_refused():
    with pytest.raises(InputError, match="difficulty must be one of 'easy', 'medium', 'hard'"):
        Varied(Corridor(), "easier")
    with pytest.raises(InputError, match="varies a Corridor, a Loop, an Office or Wings"):
        Varied(Varied(Corridor(), "easy"), "easy")  # pyright: ignore[reportArgumentType]


PLAN = FloorPlan(
    (Rect(0.0, 0.0, 6.0, 4.0), Rect(0.0, 4.2, 6.0, 8.0)),
    (Doorway((0, 1), 1.0, 1.0, 1, True), Doorway((0, 1), 3.0, 1.0, 1, False)),
)


def test_a_narrower_door_keeps_its_hinge():
    plan = narrowed(PLAN, 0.6, np.random.default_rng(0))
    for before, after in zip(PLAN.doors, plan.doors, strict=True):
        assert after.hinge == pytest.approx(before.hinge)
        assert 0.6 - LATCH_GAP <= after.width < before.width


def test_without_variety_nothing_is_drawn():
    rng, untouched = np.random.default_rng(0), np.random.default_rng(0)
    assert narrowed(PLAN, 1.0, rng) is PLAN
    clutter = Stands(0.0, 0).draw(PLAN, range(2), np.array([(1.0, 1.0), (5.0, 1.0)]), rng)
    assert clutter.solids == []
    assert clutter.walls(PLAN).tolist() == PLAN.walls.tolist()
    assert rng.random() == untouched.random()


def test_corners_are_cut_between_two_walls_and_away_from_doors():
    path = np.array([(1.0, 2.0), (5.0, 2.0)])
    found = []
    for seed in range(40):
        clutter = Stands(1.5, 0).draw(PLAN, range(2), path, np.random.default_rng(seed))
        for space, triangle in clutter.cuts:
            a, b = np.hypot(*(triangle[[0, 2], 2:] - triangle[[0, 2], :2]).T)
            assert 0.0 < min(a, b) <= max(a, b) <= 1.5
            assert np.hypot(*(triangle[1, 2:] - triangle[1, :2])) == pytest.approx(math.hypot(a, b))
            found.append((space, *triangle[0, :2].tolist()))
        assert len(clutter.walls(PLAN)) == len(PLAN.walls) + len(clutter.cuts)
    corners = {(0, x, y) for x in (0.0, 6.0) for y in (0.0, 4.0)}
    corners |= {(1, x, y) for x in (0.0, 6.0) for y in (4.2, 8.0)}
    assert set(found) <= corners
    assert {(0, 0.0, 0.0), (1, 6.0, 8.0)} <= set(found)


# -- double doors ----------------------------------------------------------------------------------


def free_edge(door):
    return np.add(door.hinge, door.width * np.array([np.cos(door.closed), np.sin(door.closed)]))


def test_a_double_door_fills_its_opening_with_two_leaves_that_open_to_the_same_side():
    plan = PLAN
    for i, doorway in enumerate(plan.doorways):
        if doorway.opens_to is None:
            continue
        changed = doorway._replace(double=True)
        one, two = plan.leaves(changed)
        single = plan.leaf(doorway)
        ends = [free_edge(each) for each in (one, two)]
        assert np.linalg.norm(ends[0] - ends[1]) == pytest.approx(0.004, abs=1e-9)
        assert one.width + two.width == pytest.approx(single.width - 0.002)
        into = [leaf.closed + leaf.swing * np.pi / 2 for leaf in (one, two, single)]
        assert np.cos(np.subtract(into, into[2])) == pytest.approx(1.0)
        assert i < len(plan.doorways)


@pytest.mark.parametrize("world", [Corridor, Loop, Office])
def test_all_or_none_are_double(world):
    one, none = world(doubled=1.0), world()
    rng = np.random.default_rng
    many = one.layout(rng(3)).doors
    few = none.layout(rng(3)).doors
    assert len(few) < len(many) <= 2 * len(few)
    assert min(door.width for door in many) < 0.5
    assert world(doubled=0.0).layout(rng(3)).plain() == none.layout(rng(3)).plain()


def test_people_wait_for_both_leaves_of_a_double_door():
    layout = Corridor(doubled=1.0, people=3).layout(np.random.default_rng(0))
    walkers = Walkers(People(), layout, np.random.default_rng(0))
    other = walkers._other_leaf
    assert (other[other] == np.arange(len(layout.doors))).all()
    assert (other != np.arange(len(layout.doors))).all()
    gates = walkers._gates
    assert (gates >= 0).any(axis=1).all()  # each way leads through a door


def test_worlds_of_a_difficulty_have_double_doors_if_asked_for(tmp_path):
    world = at_difficulty(Corridor(doubled=0.5), "hard")
    layouts = [world.layout(np.random.default_rng(i)) for i in range(8)]
    widths = [[round(door.width, 9) for door in layout.doors] for layout in layouts]
    pairs = [len(set(each)) < len(each) for each in widths]
    assert any(pairs)
    layouts[0].save(tmp_path / "world.json")
    assert Layout.load(tmp_path / "world.json").plain() == layouts[0].plain()


def test_a_crowd_passes_double_doors_without_walking_into_them():
    env = DoorWorldEnv(world=Corridor(doubled=1.0, people=4))
    env.reset(seed=1)
    moved = 0.0
    for _ in range(300):
        before = env.physics.people.copy()
        env.step(np.zeros(2, np.float32))
        moved += np.abs(env.physics.people - before).sum()
    assert moved > 10.0
