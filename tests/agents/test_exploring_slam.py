"""An agent that explores stops before doors and turns about; that does not move the map."""

import numpy as np
import pytest

import agents
from dynslam_env.patrol.env import DoorPatrolEnv
from slam.interface import LOST_DISTANCE

STEPS = 160  # of 0.4 s


def errors(variant: str, seed: int) -> list[float]:
    """m, of the position at each step of nearest-frontier."""
    env = DoorPatrolEnv(slam=variant)
    observation, _ = env.reset(seed=seed)
    agent = agents.make("nearest-frontier", env, seed)
    state, start, found = None, np.ones(1, dtype=bool), []
    for _ in range(STEPS):
        action, state = agent.predict(observation, state, start, deterministic=True)
        observation, *_, info = env.step(action)
        start = np.zeros(1, dtype=bool)
        found.append(info["slam"]["position_error"])
    env.close()
    return found


@pytest.mark.parametrize(
    ("variant", "seed"), [("static-ml", 1003), ("static-ml", 1004), ("dynamic-ml", 1010)]
)
def test_a_door_that_moves_before_the_laser_does_not_move_the_robot(variant, seed) -> None:
    assert max(errors(variant, seed)) < 0.15


def test_a_match_that_follows_a_leaf_is_not_drawn_at_once() -> None:
    assert max(errors("static-ml", 1007)) < 0.1
    assert max(errors("dynamic-ml", 1007)) < LOST_DISTANCE
