"""Where nothing touches, the kernel moves the bodies exactly as Chipmunk does."""

from typing import Any

import numpy as np
import pytest

from dynslam_env import Corridor, Doors, DoorWorldEnv, Loop, Office, Robot, Uniform
from dynslam_env.simulation import chipmunk
from dynslam_env.simulation.world import PHYSICS_DT
from slam import Pose2

QUICK = Robot(acceleration=4.0, turn_acceleration=10.0)
STEPS = 300


class AlwaysInSpace:
    """Mechanics of a world that never leaves Chipmunk."""

    apart = False

    def __init__(self, mechanics):
        self.bodies, self.contacts = mechanics.bodies, mechanics.contacts
        self.put_robot = mechanics.put_robot
        self.space = mechanics.in_space()

    def advance(self, steps):
        self.space.advance(steps, PHYSICS_DT)


def drive(env, always, seed, steps=STEPS):
    """What there is to see of a drive about and into things, and how often it was moved freely."""
    env.reset(seed=seed)
    world: Any = env.physics
    rng, told, freely, action = np.random.default_rng(seed), [], 0, np.zeros(2, np.float32)
    if always:
        world.mechanics = AlwaysInSpace(world.mechanics)
    for k in range(steps):
        if k % 10 == 0:
            action = rng.uniform(-1, 1, 2).astype(np.float32) + np.float32(0.3)
        if k == steps // 2:
            world.put_robot(Pose2(*env.layout.start))
        observation, reward, *_, info = env.step(action)
        told += [world.bodies.tobytes(), observation["scan"].tobytes(), reward, info["contact"]]
        freely += world.mechanics.apart
    return told, freely


WORLDS = {
    "corridor": {},
    "quick": {"robot": QUICK},
    "loop": {"world": Loop(), "robot": QUICK},
    "office": {"world": Office(furniture=1), "robot": QUICK},
    "oblique": {"world": Corridor(people=1), "difficulty": "hard", "robot": QUICK},
    "static": {"doors": "static", "robot": QUICK},
    "crowd": {"world": Corridor(people=6), "robot": QUICK},
    "restless": {"doors": Doors(law=Uniform(0.5, 2.0), swing_time=0.7), "robot": QUICK},
}


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("name", WORLDS)
def test_a_world_moves_as_one_that_never_leaves_chipmunk_to_the_bit(name, seed):
    env = DoorWorldEnv(**WORLDS[name])
    told, freely = drive(env, False, seed)
    assert told == drive(env, True, seed)[0]
    assert freely > 0.1 * STEPS
    if name != "office":
        assert freely < STEPS  # it did touch things


def test_no_space_is_made_until_something_touches():
    env = DoorWorldEnv(doors=Doors(law=Uniform(100.0, 200.0)))
    env.reset(seed=0)
    for _ in range(40):
        env.step(np.array([0.3, 0.0], np.float32))
    assert env.physics.mechanics._space is None
    for _ in range(200):  # into the wall at the end of the passage
        env.step(np.array([1.0, 0.02], np.float32))
    assert env.physics.mechanics._space is not None


def test_a_chipmunk_that_keeps_impulses_elsewhere_is_refused(monkeypatch):
    monkeypatch.setattr(chipmunk, "WORDS_OF_CONSTRAINT", 12)
    env = DoorWorldEnv()
    env.reset(seed=0)
    with pytest.raises(RuntimeError, match="Chipmunk keeps the impulses of joints where"):
        env.physics.mechanics.in_space()
