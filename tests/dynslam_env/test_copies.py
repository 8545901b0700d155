"""A copy of an environment goes on to the bit as the original, which does not notice."""

import copy
import pickle
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import SyncVectorEnv
from joblib import Parallel, delayed
from stable_baselines3.common.vec_env import SubprocVecEnv

from dynslam_env import (
    PATROLS,
    WORLDS,
    Corridor,
    Coupled,
    Doors,
    DoorWorldEnv,
    FlipClock,
    Layout,
    Robot,
    SlamWrapper,
    WheelEncoders,
)
from slam import Pose2
from tests.dynslam_env.test_vector import FAULTS, same

WAYS = {"deepcopy": copy.deepcopy, "pickle": lambda env: pickle.loads(pickle.dumps(env))}
MOMENTS = {"fresh": 0, "reset": 1, "later": 40}  # steps and resets before the copy
AFTER = 12  # steps after it
QUICK = Robot(acceleration=5.0, turn_acceleration=20.0)


@pytest.fixture(params=WAYS)
def copied(request):
    return WAYS[request.param]


class OwnLaw:
    """The clock draws by a closure, which copies of it would share."""

    def initial_states(self, is_open, rng):
        return is_open

    def clock(self, count, rng):
        flips = [(rng.uniform(0.1, 1.0), door) for door in range(count)]
        return FlipClock(flips, lambda: rng.uniform(0.2, 1.0))


WORLD_KINDS = {
    "people who push": {"world": Corridor(people=6), "robot": QUICK},
    "faults": {"faults": FAULTS, "robot": QUICK},
    "encoders": {"odometry": WheelEncoders(2000.0, sigma=0.02), "faults": FAULTS, "robot": QUICK},
    "own law": {"doors": Doors(law=OwnLaw(), swing_time=0.8), "robot": QUICK},
    "coupled": {"doors": Coupled(OwnLaw()), "robot": QUICK},
}
SLAMS = ("odometry", "dynamic-ml", "hmm-ml", "hmm-pf", "hmm-graph")


def go_on(env: Any, steps: int, first: int = 0) -> list[Any]:
    """What a world tells while it is driven by given actions, with a reset every 60 steps."""
    told: list[Any] = []
    for k in range(first, first + steps):
        if k % 60 == 0:
            told.append(env.reset(seed=4 if k == 0 else None))
            continue
        told.append(env.step(action_of(env, k)))
    if steps and env.render_mode == "rgb_array":
        told.append(env.render())
    return told


def action_of(env: Any, k: int) -> Any:
    """The k-th action: the robot drives about and into things."""
    if isinstance(env.action_space, gym.spaces.Discrete):
        return np.int64(k % 9)
    if isinstance(env.action_space, gym.spaces.MultiDiscrete):
        return (k + np.arange(len(env.action_space.nvec))) % 9
    rng = np.random.default_rng(k // 8)
    return (rng.uniform(-1.0, 1.0, env.action_space.shape) + 0.3).astype(np.float32)


def check(env: Any, copied: Any, before: int, after: int = AFTER) -> None:
    """Copy `env` after `before` steps; the copy, then the original, then a copy of the copy."""
    go_on(env, before)
    one = copied(env)
    other = copied(one)
    first = go_on(one, after, before)
    for again in (env, other):
        for mine, theirs in zip(first, go_on(again, after, before), strict=True):
            same(as_tuple(mine), as_tuple(theirs))


def as_tuple(told: Any) -> Any:
    return tuple(told) if isinstance(told, list) else told


@pytest.mark.parametrize("moment", MOMENTS)
@pytest.mark.parametrize("name", [*WORLDS, *PATROLS])
def test_every_environment(name, moment, copied):
    steps = min(MOMENTS[moment], 8) if name in PATROLS else MOMENTS[moment]
    env = gym.make(name, render_mode="rgb_array")
    check(env, copied, steps, 4 if name in PATROLS else AFTER)


@pytest.mark.parametrize("kind", WORLD_KINDS)
def test_faults_people_and_laws_of_ones_own(kind, copied):
    for before in (0, 7, 50):
        check(DoorWorldEnv(**WORLD_KINDS[kind]), copied, before, 60)


@pytest.mark.parametrize("slam", SLAMS)
def test_a_slam_wrapper(slam, copied):
    env = SlamWrapper(
        gym.make("DoorCorridor-v0", render_mode="rgb_array"), slam, score_every=4,
        map_crop=4.0, pose_estimate=True,
    )  # fmt: skip
    check(env, copied, 10, 10)


@pytest.mark.parametrize("before", [0, 1, 25])
@pytest.mark.parametrize("name", [*WORLDS, *PATROLS[:2]])
def test_native_vector_environments(name, before, copied):
    env = gym.make_vec(name, 3, max_episode_steps=20, threads=2)
    check(env, copied, min(before, 6) if name in PATROLS else before, 4 if name in PATROLS else 12)
    env.close()


def test_a_vector_environment_whose_episodes_began_apart(copied):
    env = gym.make_vec("DoorCrowd-v0", 3, autoreset_mode="Disabled")
    env.reset(seed=1)
    for k in range(5):
        env.step(action_of(env, k))
    env.reset(options={"reset_mask": np.array([False, True, False])})
    check_going_on(env, copied)


def check_going_on(env: Any, copied: Any) -> None:
    """As `check`, without resets."""
    one = copied(env)
    for k in range(20):
        same(one.step(action_of(env, k)), env.step(action_of(env, k)))


def test_vector_environments_of_gymnasium():
    env = SyncVectorEnv([lambda: gym.make("DoorCorridor-v0", max_episode_steps=9)] * 2)
    env.reset(seed=2)
    one = copy.deepcopy(env)
    for k in range(15):
        same(one.step(action_of(env, k)), env.step(action_of(env, k)))


def test_in_contact_with_several_things_at_once(copied):
    """The robot pushes into a corner, and people push it: the solver starts from old impulses."""
    walls = [(0, 0, 3, 0), (3, 0, 3, 2), (3, 2, 0, 2), (0, 2, 0, 0)]
    routes = (np.array([(0.4, 0.4), (2.7, 1.0)]), np.array([(0.4, 1.5), (2.7, 0.8)]))
    layout = Layout(np.array(walls), (), Pose2(2.6, 0.4, -0.7), np.array([(1.0, 1.0)]), routes)
    env, touched = DoorWorldEnv(world=layout, robot=QUICK), 0
    env.reset(seed=0)
    for k in range(120):
        if k % 10 == 5:
            one = copied(env)
            for _ in range(8):
                one.step(np.array([0.9, 0.1], np.float32))
            check_poses(one, copied(env))
        *_, info = env.step(np.array([0.9, 0.1], np.float32))
        touched += info["collision"]
    assert touched > 60


def check_poses(one: DoorWorldEnv, env: DoorWorldEnv) -> None:
    """`one` is 8 steps ahead of `env`, which catches up."""
    for _ in range(8):
        env.step(np.array([0.9, 0.1], np.float32))
    assert one.physics.bodies.tobytes() == env.physics.bodies.tobytes()


def test_a_copy_shares_no_world(copied):
    env = DoorWorldEnv()
    env.reset(seed=0)
    one = copied(env)
    assert one.physics is not env.physics
    before = env.physics.bodies
    one.step(np.ones(2, np.float32))
    assert np.array_equal(before, env.physics.bodies)
    assert not one.layout.walls.flags.writeable


def test_a_robot_that_was_put_down_stays_there(copied):
    env = DoorWorldEnv()
    env.reset(seed=0)
    for place in (Pose2(2.0, 0.0, 1.0), Pose2(3.0, 0.1, -1.0)):
        for _ in range(3):
            env.step(np.ones(2, np.float32))
        env.physics.put_robot(place)
        one = copied(env)
        assert one.physics.robot.tolist() == env.physics.robot.tolist()
        same(one.step(np.ones(2, np.float32)), env.step(np.ones(2, np.float32)))


def test_in_processes_of_stable_baselines():
    env = DoorWorldEnv()
    envs = SubprocVecEnv([lambda: env], start_method="spawn")
    here: Any = DoorWorldEnv()
    envs.seed(3)
    seen, expected = envs.reset(), here.reset(seed=3)[0]
    for k in range(5):
        assert isinstance(seen, dict)
        for key in expected:
            assert seen[key][0].tobytes() == expected[key].tobytes()
        action = action_of(env, k)
        seen, expected = envs.step(action[None])[0], here.step(action)[0]
    envs.close()


def scan_after(env: Any, actions: Any) -> np.ndarray:
    return [env.step(action)[0]["scan"] for action in actions][-1]


def test_in_processes_of_joblib():
    env = DoorWorldEnv()
    env.reset(seed=3)
    actions = [action_of(env, k) for k in range(4)]
    jobs = (delayed(scan_after)(env, actions) for _ in range(2))
    first, second = Parallel(n_jobs=2)(jobs)
    assert np.asarray(first).tobytes() == np.asarray(second).tobytes()
    assert scan_after(env, actions).tobytes() == np.asarray(first).tobytes()
