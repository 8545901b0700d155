from typing import Any

import gymnasium as gym
import numpy as np
import pytest

pytest.importorskip("stable_baselines3")

from stable_baselines3 import PPO
from stable_baselines3.common.vec_env import DummyVecEnv, VecMonitor

import dynslam_env
from agents.vec_env import NativeVecEnv
from slam import InputError
from tests.dynslam_env.test_vector import same

PARAMETERS = {"task": dynslam_env.Task(ends=("crashed",)), "max_episode_steps": 40,
              "robot": dynslam_env.Robot(acceleration=3.0)}  # fmt: skip


def test_it_gives_what_a_dummy_vec_env_gives():
    native: Any = NativeVecEnv.make("DoorCorridor-v0", 3, **PARAMETERS)
    dummy: Any = DummyVecEnv([lambda: gym.make("DoorCorridor-v0", **PARAMETERS)] * 3)
    rng, over, late = np.random.default_rng(0), 0, 0
    for env in (native, dummy):
        env.seed(7)
    same(dict(native.reset()), dict(dummy.reset()))
    for _ in range(120):
        actions = rng.uniform(-1, 1, (3, 2)).astype(np.float32)
        actions[0] = -1.0, 0.0  # into the wall behind
        mine, theirs = native.step(actions), dummy.step(actions)
        for a, b in zip(mine, theirs, strict=True):
            same(a, b) if not isinstance(a, dict | list) else None
        same(dict(mine[0]), dict(theirs[0]))
        for a, b in zip(mine[3], theirs[3], strict=True):
            same(a, b)
        for a, b in zip(native.reset_infos, dummy.reset_infos, strict=True):
            same(a, b)
        over += int(mine[2].sum())
        late += sum(info["TimeLimit.truncated"] for info in mine[3])
    assert over > late > 0


def test_ppo_learns_on_it():
    env = VecMonitor(NativeVecEnv.make("DoorCorridor-v0", 4, max_episode_steps=50))
    model: Any = PPO("MultiInputPolicy", env, n_steps=64, batch_size=64, n_epochs=2, seed=0)
    before = model.policy.state_dict()["action_net.weight"].clone()
    model.learn(512)
    after = model.policy.state_dict()["action_net.weight"]
    assert (before != after).any()
    assert model.num_timesteps == 512
    assert len(model.ep_info_buffer) >= 8
    assert all(info["l"] == 50 for info in model.ep_info_buffer)


def test_what_it_cannot_do_is_said():
    with pytest.raises(InputError, match='needs autoreset_mode="SameStep"'):
        NativeVecEnv(gym.make_vec("DoorCorridor-v0", 2))
    env = NativeVecEnv.make("DoorCorridor-v0", 2)
    for call in (lambda: env.env_method("render"), lambda: env.set_attr("pose", 1)):
        with pytest.raises(InputError, match="share one object"):
            call()
    assert env.get_attr("render_mode") == [None, None]
    assert env.env_is_wrapped(gym.Wrapper) == [False, False]
    env.close()
