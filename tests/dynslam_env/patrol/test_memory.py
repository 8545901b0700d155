import math
from itertools import pairwise
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

from dynslam_env.patrol.memory import (
    FRESHNESS_SCALE,
    FULL_WEIGHT_TIME,
    MIN_WATCH_TIME,
    STATIC_WEIGHT,
    DynamicMap,
)
from slam import Pose2

from .drawn import UP, fan, wall
from .naive import NaiveMemory

STRAIGHT = Pose2(0.0, 0.0, 0.0)
LEAF = np.array([(2.03, 0.0)])  # what stands there is seen 2.03 m ahead
PERIOD = 0.2  # s, between two scans


def watch(memory, until, ahead, time):
    """Look at a wall `ahead` m away for some time; what is the time then, and the bits."""
    bits = []
    while time < until - 1e-9:
        time += PERIOD
        bits.append(memory.look(wall(ahead, time), STRAIGHT))
    return time, bits


def flips(memory, point, time):
    beliefs = memory.beliefs(time)
    (row, col), *_ = beliefs.spec.cells(np.array([point]))
    return beliefs.flips[row, col]


def bits_of(odds):
    p = 1 / (1 + math.exp(-odds))
    return -p * math.log2(p) - (1 - p) * math.log2(1 - p)


def test_what_a_first_scan_tells_is_counted_by_hand():
    memory = DynamicMap()
    found = memory.look(wall(2.03), STRAIGHT)
    seen = memory.map.cells.grid()
    hits = int((seen.occupied > 0.5).sum())
    free = int(seen.observed.sum()) - hits
    assert hits >= 11
    assert free >= 60
    assert found == pytest.approx(hits * (1 - bits_of(3)) + free * (1 - bits_of(-1)), rel=1e-6)


@pytest.mark.parametrize("seed", range(4))
def test_it_is_the_dict_of_cells(seed):
    """Over a walk through a place whose walls come and go."""
    rng = np.random.default_rng(seed)
    memory, naive, time = DynamicMap(), NaiveMemory(), 0.0
    ranges, x, theta = rng.uniform(0.5, 3.0, 21), 0.007, rng.uniform(-3, 3)
    for k in range(60):
        ranges = np.where(rng.random(21) < 0.1, rng.uniform(0.5, 3.0, 21), ranges)
        scan, pose = fan(ranges, time, 2.0), Pose2(x, 0.011, theta)
        assert memory.look(scan, pose) == pytest.approx(naive.look(scan, pose), abs=1e-4), k
        time += rng.choice([0.1, 0.4, 3.0], p=[0.3, 0.6, 0.1])
        assert memory.freshness(time) == pytest.approx(naive.freshness(time), rel=1e-3, abs=1e-3)
        x, theta = x + rng.uniform(0, 0.01), theta + rng.uniform(-0.02, 0.02)
    assert memory.freshness(time) > 1.0
    grid = memory.map.predicted(time)
    for (row, col), cell in naive.cells.items():
        at = row - grid.spec.row0, col - grid.spec.col0
        assert grid.occupied[at] == pytest.approx(cell.predicted(time), abs=2e-3)


def test_the_same_again_tells_less_and_less():
    memory = DynamicMap()
    _, bits = watch(memory, 5.0, 2.03, 0.0)
    assert all(a > b for a, b in pairwise(bits[2:10]))
    assert abs(bits[-1]) < 0.01 * bits[0]


def test_what_contradicts_costs_bits():
    memory = DynamicMap()
    time, _ = watch(memory, 3.0, 4.0, 0.0)  # nothing is new when the wall is gone
    time, _ = watch(memory, 6.0, 2.03, time)
    _, bits = watch(memory, 8.0, 4.0, time)
    assert max(bits[4:8]) < 0  # first there is some doubt, then much


def test_a_wall_that_is_grazed_is_not_seen_free():
    memory = DynamicMap()
    points = np.array([(x, 1.03) for x in (-0.2, 0.0, 0.2)])  # of a cell from 0.90 to 1.05 m
    for k in range(10):
        memory.look(wall(1.03, 0.2 * k), UP)
    before = memory.occupied(points, 2.0)
    assert (before > 0.99).all()
    for k in range(10):  # along the wall, 10 cm before it, through its cells
        memory.look(fan(np.full(3, 4.0), 2.0 + 0.2 * k, 0.001), Pose2(-2.0, 0.93, 0.0))
    assert memory.occupied(points, 4.0) == pytest.approx(before, abs=0.01)
    for k in range(10):  # and where it was
        memory.look(fan(np.full(3, 4.0), 4.0 + 0.2 * k, 0.001), Pose2(-2.0, 1.03, 0.0))
    assert (memory.occupied(points, 6.0) < 0.1).all()


def test_the_first_echo_is_no_change_and_the_next_one_is():
    memory = DynamicMap()
    time, _ = watch(memory, 3.0, 4.0, 0.0)
    assert memory.occupied(LEAF, time) < 0.1
    time, _ = watch(memory, 6.0, 2.03, time)
    assert memory.occupied(LEAF, time) > 0.9
    assert flips(memory, LEAF[0], time) == 0.0
    time, _ = watch(memory, 10.0, 4.0, time)
    assert memory.occupied(LEAF, time) < 0.1
    assert flips(memory, LEAF[0], time) > 0.0


def opened_and_closed():
    memory, time = DynamicMap(), 0.0
    for until, ahead in ((5, 2.03), (10, 4.0), (15, 2.03), (20, 4.0), (25, 2.03)):
        time, _ = watch(memory, until, ahead, time)
    return memory, time


def test_a_door_is_restless_and_a_wall_is_not():
    memory, time = opened_and_closed()
    for k in range(20):
        memory.look(wall(1.03, time + PERIOD * (k + 1)), UP)
    time += 20 * PERIOD
    assert flips(memory, LEAF[0], time) == pytest.approx(4 / 25, rel=0.15)
    assert flips(memory, (0.0, 1.03), time) == 0.0


def test_a_door_that_nobody_looks_at_is_less_and_less_known():
    memory, time = opened_and_closed()
    later = np.array([memory.occupied(LEAF, time + dt)[0] for dt in range(0, 60, 5)])
    assert later[0] > 0.99
    assert (np.diff(later) < 0).all()
    assert 0.3 < later[-1] < 0.7


def test_what_was_seen_lately_fades():
    memory, time = opened_and_closed()
    now = memory.freshness(time)
    assert now > 5.0
    assert memory.freshness(time + FRESHNESS_SCALE) == pytest.approx(now / math.e)


def test_looking_again_is_worth_something_where_doors_are_alone():
    door, time = opened_and_closed()
    wall_, same = DynamicMap(), 0.0
    watch(wall_, time, 2.03, same)
    assert door.look(wall(2.03, time + 20.0), STRAIGHT) > 3.0
    assert abs(wall_.look(wall(2.03, time + 20.0), STRAIGHT)) < 1.5


def test_a_cell_counts_in_full_when_it_was_watched_long_enough_in_both_states():
    memory = DynamicMap()
    time, _ = watch(memory, 6.0, 2.03, 0.0)
    fresh = {}
    while time < 18.0:
        time, _ = watch(memory, time + PERIOD, 4.0, time)
        fresh[round(time, 3)] = memory.freshness(time)
    still = min(fresh.values())  # all that it sees, and none of it known to change
    more = {t: value - still for t, value in fresh.items()}
    first = max(t for t, value in more.items() if value < 0.5)  # the change itself
    full = more[round(first + 2 * FULL_WEIGHT_TIME, 3)]
    assert full > 5.0
    assert more[round(first + FULL_WEIGHT_TIME / 3, 3)] == pytest.approx(full / 3, rel=0.2)
    assert more[round(first + FULL_WEIGHT_TIME, 3)] == pytest.approx(full, rel=0.1)


def test_what_never_changed_counts_a_little():
    memory = DynamicMap()
    memory.look(wall(2.03), STRAIGHT)
    echoed = int((memory.map.cells.grid().occupied > 0.5).sum())
    assert memory.freshness(0.0) == pytest.approx(STATIC_WEIGHT * echoed)


def test_it_is_not_known_where_nothing_was_seen():
    memory = DynamicMap()
    memory.look(wall(2.03), STRAIGHT)
    points = np.array([(1.0, 0.0), (-0.5, 0.0), (2.5, 0.0), (500.0, 3.0), (-1e6, 1e6)])
    assert np.isnan(memory.occupied(points, 1.0)).tolist() == [False, True, True, True, True]
    beliefs = memory.beliefs(3.0)
    assert (np.isinf(beliefs.age) == ~beliefs.observed).all()
    assert beliefs.age[beliefs.observed] == pytest.approx(3.0)


def test_beliefs_are_the_whole_map_predicted():
    """As `HMM.predicted` and the layers of the map tell them, in arrays of all cells."""
    env: Any = gym.make("DoorPatrol-v0").unwrapped
    env.reset(seed=3)
    for k in range(60):
        env.step(np.array([0.6, 0.4 * math.sin(k)], np.float32))
    memory, time = env.patroller.memory, env.time + 1.5
    known, tiles, beliefs = memory.map, memory.map.cells.tiles, memory.beliefs(time)
    grid = known.predicted(time)
    watched = np.maximum(tiles.dense(known.times).sum(axis=2), MIN_WATCH_TIME)
    flips = tiles.dense(known.counts).sum(axis=2) / watched
    age = np.where(grid.observed, known.since_start(time) - tiles.dense(known.last), np.inf)
    assert beliefs.spec == grid.spec
    assert (flips > 0).any()
    for mine, theirs in zip(beliefs[1:], (grid.occupied, grid.observed, age, flips), strict=True):
        np.testing.assert_array_equal(mine, theirs.astype(mine.dtype))
