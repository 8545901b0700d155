import math
from dataclasses import replace

import numpy as np
import pytest

from dynslam_env import Loop
from slam import InputError
from tests.dynslam_env.worlds.driven import drive


def drawn(seed=0, **parameters):
    return Loop(**parameters).layout(np.random.default_rng(seed))


def test_the_path_leads_once_around_the_block():
    x, y = drawn().path.T
    area = ((x[:-1] * y[1:] - x[1:] * y[:-1]) / 2).sum()
    assert area == pytest.approx(12.0 * 8.0)  # counter-clockwise, in the middle of the corridors
    assert np.abs(np.diff([x, y])).sum() == pytest.approx(40.0)


@pytest.mark.parametrize("laps", [1, 2, 5])
def test_laps(laps):
    path = drawn(laps=laps).path
    assert len(path) == 4 * laps + 1
    assert np.hypot(*np.diff(path, axis=0).T).sum() == pytest.approx(40.0 * laps)
    assert path[0].tolist() == path[-1].tolist()


@pytest.mark.parametrize(("outer", "inner"), [(3, 2), (0, 2), (4, 0), (0, 0)])
def test_doors_on_all_sides_and_in_the_block(outer, inner):
    hinges = np.array([d.hinge for d in drawn(outer_doors=outer, inner_doors=inner).doors])
    x, y = hinges.reshape(-1, 2).T
    for beyond in (x < 0, x > 14, y < 0, y > 10):
        assert beyond.sum() == outer
    block = (x > 2) & (x < 12) & (y > 2) & (y < 8)
    assert (block & (y < 5)).sum() == (block & (y > 5)).sum() == inner
    assert len(hinges) == 4 * outer + 2 * inner


def test_another_layout_each_time_but_the_same_ring():
    first, second = drawn(0), drawn(1)
    assert first.doors != second.doors
    assert first.path.tolist() == second.path.tolist()


def test_people_change_nothing_else():
    assert replace(drawn(people=4), routes=()).plain() == drawn().plain()


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"length": 4.0}, "must leave a block between corridors of 2 m, got 4 x 10 m"),
        ({"width": 4.9}, "must leave a block"),
        ({"outer_doors": 6}, "Loop.outer_doors: 6 doors of 0.9 m .* more than a side's 8 m"),
        ({"inner_doors": 7}, "Loop.inner_doors: 7 doors"),
        ({"breadth": 6.2}, "rooms in the block must be at least as deep as a door is wide"),
        ({"laps": 0}, "Loop.laps must be a whole number of at least 1, got 0"),
        ({"room_depth": math.inf}, "Loop.room_depth"),
        ({"people": 1, "outer_doors": 0, "inner_doors": 0}, "need outer_doors or inner_doors"),
        ({"people": 1, "room_depth": 1.0}, "at least 1.6 m deep"),
        ({"clearance": 0.05}, "Loop.clearance"),
    ],
)
def test_wrong_parameters_are_refused(wrong, message):
    with pytest.raises(InputError, match=message):
        Loop(**wrong)


def test_a_scripted_drive_comes_around():
    assert drive("DoorLoop-v0", 0) == (True, 0)
