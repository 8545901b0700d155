"""What `info["contact"]` tells of a robot that drives against a wall of a room of its own, and off
again."""

import gymnasium as gym
import numpy as np
import pytest

import dynslam_env
from dynslam_env import Door, Layout
from dynslam_env.simulation.contacts import CONTACT_COLUMNS
from slam import Pose2

ROOM = [(0, 0, 4, 0), (4, 0, 4, 3), (4, 3, 0, 3), (0, 3, 0, 0)]
LEAF = Door((3.0, 1.0), np.pi / 2, 1, 0.9, 0.04)  # closed: across the way along y = 1.5
FORTH, BACK = (np.array([v, 0.0], dtype=np.float32) for v in (0.5, -0.5))
NOTHING = dict.fromkeys(CONTACT_COLUMNS, False) | {"impulse": 0.0}


def driven(y, doors=(), steps=60):
    """Infos of a drive along x against what is there, for `steps`, and back again."""
    world = Layout(np.array(ROOM), doors, Pose2(1.5, y, 0.0), np.array([(1.0, y)]))
    law = dynslam_env.Doors(law=dynslam_env.Fixed(), open_share=0.0)
    env = gym.make("DoorCorridor-v0", world=world, doors=law)
    env.reset(seed=0)
    return [env.step(action)[-1] for action in [FORTH] * steps + [BACK] * 15]


@pytest.mark.parametrize(("y", "doors", "kind"), [(0.5, (), "wall"), (1.5, (LEAF,), "door")])
def test_it_tells_what_is_touched_and_how_hard(y, doors, kind):
    pressing = driven(y, doors)[59]
    others = {"wall": False, "door": False, "person": False} | {kind: True}
    assert pressing["collision"]
    assert {name: pressing["contact"][name] for name in others} == others
    assert pressing["contact"]["at_end"]
    # the wheels push with 60 N for 0.1 s: the wall pushes back
    assert pressing["contact"]["impulse"] == pytest.approx(6.0, rel=0.05)


def test_a_step_that_ends_clear_says_so():
    infos = driven(0.5)
    touched = [info["collision"] for info in infos]
    last = len(touched) - 1 - touched[::-1].index(True)
    assert 59 < last < len(infos) - 1  # it was free again on the way back
    assert not infos[last]["contact"]["at_end"]
    assert infos[last]["contact"]["wall"]
    assert infos[last]["contact"]["impulse"] < 6.0
    for info in (infos[0], infos[-1]):
        assert not info["collision"]
        assert info["contact"] == NOTHING
