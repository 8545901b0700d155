import math

import numpy as np
import pytest

from dynslam_env import Corridor, Doors
from dynslam_env.doors import Leaves, schedule
from slam import InputError
from tests.dynslam_env import naive


def flips(doors, count=8, until=2000.0, step=0.1, seed=0):
    """Times at which each door flips."""
    law = schedule(doors, count, np.random.default_rng(seed))
    times = [[] for _ in range(count)]
    for i in range(round(until / step)):
        for door in law.due(i * step):
            times[door].append(i * step)
    return times


def test_moving_doors_dwell_5_to_20_seconds():
    dwells = np.concatenate([np.diff([0.0, *times]) for times in flips(Doors())])
    assert 5.0 - 0.1 <= dwells.min() < 5.3
    assert 19.7 < dwells.max() <= 20.0 + 0.1
    deviation = 15 / math.sqrt(12 * len(dwells))
    assert dwells.mean() == pytest.approx(12.5, abs=5 * deviation)


def test_how_often_one_asks_changes_no_flip():
    coarse, fine = (flips(Doors(), step=step, until=100.0) for step in (1.0, 0.1))
    assert [len(times) for times in coarse] == pytest.approx([len(t) for t in fine], abs=1)
    for a, b in zip(coarse, fine, strict=True):
        n = min(len(a), len(b))
        assert np.abs(np.array(a[:n]) - b[:n]).max() <= 1.0


def test_static_doors_never_flip():
    assert not any(flips(Doors(law="static"), until=100.0))


def test_no_doors_no_flips():
    assert flips(Doors(), count=0, until=100.0) == []


def test_outlines_agree_with_the_naive_reference():
    doors = Corridor().layout(np.random.default_rng(0)).doors
    angles = np.random.default_rng(1).uniform(-4, 4, len(doors))
    out = Leaves(doors).outline(angles.tolist(), np.empty((4 * len(doors), 4)))
    expected = [naive.leaf(door, angle) for door, angle in zip(doors, angles, strict=True)]
    assert out == pytest.approx(np.concatenate(expected))


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"law": "revolving"}, "Doors.law must be one of 'moving', 'static', got 'revolving'"),
        ({"dwell_min": 30.0}, "dwell_min <= dwell_max"),
        ({"open_share": 1.5}, "open_share must be a finite number from 0 to 1, got 1.5"),
        ({"open_angle": 2.0}, "open_angle"),
        ({"torque": 0.0}, "torque must be a finite number above 0"),
    ],
)
def test_wrong_parameters_are_refused(wrong, message):
    with pytest.raises(InputError, match=message):
        Doors(**wrong)
