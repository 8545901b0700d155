"""An agent that explores stops before doors and turns about; that does not move the map."""

import numpy as np
import pytest

import agents
from dynslam_env.patrol.env import DoorPatrolEnv

STEPS = 120  # of 0.4 s


@pytest.mark.parametrize(
    ("variant", "seed"), [("static-ml", 1003), ("static-ml", 1004), ("dynamic-ml", 1010)]
)
def test_a_door_that_moves_before_the_laser_does_not_move_the_robot(variant, seed) -> None:
    env = DoorPatrolEnv(slam=variant)
    observation, _ = env.reset(seed=seed)
    agent = agents.make("nearest-frontier", env, seed)
    state, start, errors = None, np.ones(1, dtype=bool), []
    for _ in range(STEPS):
        action, state = agent.predict(observation, state, start, deterministic=True)
        observation, *_, info = env.step(action)
        start = np.zeros(1, dtype=bool)
        errors.append(info["slam"]["position_error"])
    env.close()
    assert max(errors) < 0.15
