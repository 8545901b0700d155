import os
import signal
from multiprocessing import active_children
from typing import Any

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

from agents.training.workers import Workers
from agents.vec_env import NativeVecEnv
from slam import InputError
from tests.dynslam_env.test_vector import same

N = 4
PATROL = {"max_episode_steps": 5, "slam": "odometry"}


@pytest.fixture(scope="module")
def two():
    env = Workers("DoorPatrol-v0", N, 2, PATROL)
    yield env
    env.close()


def alike(mine, theirs):
    """Two `VecEnvStepReturn` are equal to the bit."""
    for a, b in zip(mine, theirs, strict=True):
        same(tuple(a) if isinstance(a, list) else a, tuple(b) if isinstance(b, list) else b)


def test_it_is_one_process_bit_for_bit(two):
    one: Any = NativeVecEnv.make("DoorPatrol-v0", N, **PATROL)
    rng, over = np.random.default_rng(0), 0
    for env in (one, two):
        env.seed(11)
    same(one.reset(), two.reset())
    alike(one.reset_infos, two.reset_infos)
    for _ in range(12):
        actions = rng.uniform(-1, 1, (N, 2)).astype(np.float32)
        mine, theirs = one.step(actions), two.step(actions)
        alike(mine, theirs)
        alike(one.reset_infos, two.reset_infos)
        over += int(mine[2].sum())
    assert over == 2 * N


def test_seeds_hold_for_one_reset(two):
    two.seed(3)
    first = two.reset()
    assert (two.reset()["scan"] != first["scan"]).any()
    two.seed(3)
    same(two.reset(), first)


def test_what_is_observed_owns_its_memory(two):
    two.seed(3)
    first = two.reset()
    kept = {key: rows.copy() for key, rows in first.items()}
    two.step(np.ones((N, 2), np.float32))
    same(first, kept)


def test_a_mistake_of_one_worker_is_told_and_does_not_confuse_the_other(two):
    two.seed(3)
    first = two.reset()
    wrong = np.zeros((N, 2), np.float32)
    wrong[0] = np.nan  # of the first worker
    with pytest.raises(InputError, match="finite"):
        two.step(wrong)
    two.seed(3)
    same(two.reset(), first)


def test_it_says_what_it_cannot_do(two):
    for call in (lambda: two.env_method("render"), lambda: two.set_attr("pose", 1)):
        with pytest.raises(InputError, match="share one object"):
            call()
    assert two.get_attr("render_mode") == [None] * N


def test_worlds_are_divided_equally():
    with pytest.raises(InputError, match="num_envs must be a multiple of workers, got 4 and 3"):
        Workers("DoorPatrol-v0", N, 3, PATROL)
    with pytest.raises(InputError, match="workers must be a whole number of at least 1"):
        Workers("DoorPatrol-v0", N, 0, PATROL)


def test_wrong_parameters_are_told_before_there_are_processes():
    before = len(active_children())
    with pytest.raises(InputError, match="unknown SLAM variant 'magic'"):
        Workers("DoorPatrol-v0", N, 2, {"slam": "magic"})
    assert len(active_children()) == before


def test_a_worker_that_is_killed_is_told_and_close_ends_the_others():
    env = Workers("DoorPatrol-v0", 2, 2, PATROL)
    env.reset()
    env.reset()
    assert all(process.is_alive() for process in env._processes)
    victim = env._processes[1]
    assert victim.pid is not None
    os.kill(victim.pid, signal.SIGKILL)
    victim.join()
    for _ in range(2):
        with pytest.raises(RuntimeError, match="a worker of the vector environment died"):
            env.step(np.zeros((2, 2), np.float32))
    env.close()
    env.close()
    assert not any(process.is_alive() for process in env._processes)
