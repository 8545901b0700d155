import math

import numpy as np
import pytest

from dynslam_env.patrol.belief_map import DOORWAY_DEPTH, BeliefMap
from dynslam_env.patrol.env import DoorPatrolEnv
from dynslam_env.patrol.memory import DynamicMap
from slam import Pose2

from .doorway import FACE, doorway

FACING, AWAY = Pose2(0.0, 0.0, math.pi / 2), Pose2(0.0, 0.0, -math.pi / 2)
LEAF = np.array([(x, FACE + 0.1) for x in (-0.3, 0.0, 0.3)])
PERIOD = 0.2  # s, between two scans


def watch(memory, closed, begin, end):
    """Look at the doorway from `begin` to `end`, s."""
    for time in np.arange(begin, end - 1e-9, PERIOD):
        memory.look(doorway(closed, float(time)), FACING)


def shut(memory, time):
    return float(np.mean(memory.occupied(LEAF, time)))


@pytest.mark.parametrize("closed", [False, True])
def test_a_door_is_suspected_by_its_shape_before_it_flips(closed):
    memory = BeliefMap()
    watch(memory, closed, 0.0, 1.0)
    (door,) = memory.doors.known()
    assert door.filter.flips == 0
    assert door.has_leaf == closed  # an open gap may be a doorway without a door


def test_it_follows_a_flip_within_half_a_second():
    memory, time = BeliefMap(), 0.0
    for k in range(8):
        watch(memory, k % 2 == 1, time, time + 8.0)
        if k:
            followed = BeliefMap.occupied(memory, LEAF, time + 8.0 - PERIOD)
            assert np.all((followed > 0.9) if k % 2 else (followed < 0.1))
        time += 8.0
        watch(memory, k % 2 == 0, time, time + 0.5)
        assert (shut(memory, time + 0.4) > 0.9) == (k % 2 == 0)
        watch(memory, k % 2 == 1, time + 0.6, time + 2.0)
        time += 2.0


def test_flips_are_counted_strictly():
    memory = BeliefMap()
    watch(memory, True, 0.0, 20.0)
    memory.look(doorway(False, 20.0), FACING)  # a single scan is no flip
    watch(memory, True, 20.2, 40.0)
    (door,) = memory.doors.known()
    assert door.filter.flips == 0
    assert not memory.beliefs(40.0).flips.any()
    watch(memory, False, 40.0, 50.0)
    assert door.filter.flips == 1
    beliefs = memory.beliefs(50.0)
    rows, cols = np.nonzero(beliefs.flips)
    away = np.hypot(*(beliefs.spec.centres(np.column_stack([rows, cols])) - (0.0, FACE)).T)
    assert len(away)
    assert away.max() < 1.6


def test_cells_between_the_jambs_are_as_closed_as_the_door_and_others_are_not():
    memory = BeliefMap()
    watch(memory, True, 0.0, 20.0)
    (door,) = memory.doors.known()
    cells, beliefs = DynamicMap.beliefs(memory, 60.0), memory.beliefs(60.0)
    x, y, direction, width = door.place
    rows, cols = np.nonzero(cells.observed)
    off = beliefs.spec.centres(np.column_stack([rows, cols])) - (x, y)
    along = off @ (math.cos(direction), math.sin(direction))
    across = off @ (-math.sin(direction), math.cos(direction))
    inside = (abs(along) <= width / 2) & (abs(across) <= DOORWAY_DEPTH)
    occupied = beliefs.occupied[rows, cols]
    assert 5 < inside.sum() < 50
    assert occupied[inside] == pytest.approx(memory.doors.closed(door, 60.0))
    assert np.array_equal(occupied[~inside], cells.occupied[rows, cols][~inside])


def test_what_is_not_seen_drifts_to_what_the_doors_do():
    memory, time = BeliefMap(), 0.0
    for k in range(12):
        watch(memory, k % 2 == 0, time, time + 10.0)
        time += 10.0
    p = [shut(memory, time + gap) for gap in (0.0, 5.0, 300.0)]
    assert p[0] < 0.1 < p[1] < 0.9
    assert p[2] == pytest.approx(0.5, abs=0.12)


def test_an_unrecognised_doorway_drifts_and_one_never_seen_has_no_belief():
    memory = BeliefMap()
    for time in np.arange(0.0, 2.0, PERIOD):
        memory.look(doorway(True, float(time), half=0.0), FACING)  # a plain wall
    wall = np.array([(0.0, FACE)])
    now, later = (float(memory.occupied(wall, time)[0]) for time in (2.0, 600.0))
    assert now > 0.9
    assert 0.4 < later < 0.8
    assert np.isnan(memory.occupied(np.array([(0.0, -3.0)]), 2.0)).all()


def test_a_patrol_takes_it_as_its_memory_and_has_the_old_one_by_default():
    env, plain = DoorPatrolEnv(memory=BeliefMap), DoorPatrolEnv()
    for each in (env, plain):
        each.reset(seed=1)
    observation, *_, info = env.step(np.array([0.5, 0.2], np.float32))
    assert type(plain.patroller.memory) is DynamicMap
    assert type(env.patroller.memory) is BeliefMap
    assert env.observation_space.contains(observation)
    assert 0.0 <= info["door_brier"] <= 1.0
    assert env.snapshot().beliefs.observed.any()
