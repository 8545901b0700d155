"""The native vector form of DoorPatrolGoals-v0 gives what n single environments give."""

import copy
import pickle
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv

from dynslam_env import Gap, Slip
from dynslam_env.patrol.goal_options import SLOTS
from dynslam_env.patrol.goals_vector import DoorPatrolGoalsVectorEnv
from dynslam_env.patrol.rewards import RewardWeights
from slam import InputError
from tests.dynslam_env.test_vector import same

N = 3
KINDS = {
    "corridor": {"budget": 6.0},
    "office": {"world": "office", "budget": 6.0, "patience": 2.0},
    "crowd": {"world": "crowd", "budget": 8.0, "patience": 6.0},
    "faulty": {"faults": [Gap(0.9, at=0.7), Slip(at=1.0)], "budget": 6.0},
    "other": {"slam": "static-ml", "hold": 3, "scan_every": 3, "patience": 3.0, "budget": 6.0,
              "reward": RewardWeights({"pose": 1.0})},
}  # fmt: skip


def pair(mode, limit=None, **parameters) -> tuple[Any, Any]:
    def single():
        return gym.make("DoorPatrolGoals-v0", max_episode_steps=limit, **parameters)

    limits = {} if limit is None else {"max_episode_steps": limit}
    native = gym.make_vec("DoorPatrolGoals-v0", N, autoreset_mode=mode, **limits, **parameters)
    return native, SyncVectorEnv([single] * N, autoreset_mode=mode)


def drawn(rng, observation):
    """A goal for each world, of those that it has."""
    return np.array([rng.choice(np.flatnonzero(mask)) for mask in observation["action_mask"]])


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
def test_it_is_n_single_environments_bit_for_bit(mode, kind):
    native, sync = pair(mode, **KINDS[kind])
    assert isinstance(native, DoorPatrolGoalsVectorEnv)
    for name in ("observation_space", "action_space", "single_observation_space"):
        assert getattr(native, name) == getattr(sync, name)
    rng, ends, steps = np.random.default_rng(1), 0, set()
    seen = native.reset(seed=5)
    same(seen, sync.reset(seed=5))
    for _ in range(9):
        actions = drawn(rng, seen[0])
        seen = native.step(actions)
        same(seen, sync.step(actions))
        ends += int((seen[2] | seen[3]).sum())
        steps |= set(seen[4].get("steps", np.zeros(N)).tolist())
    assert ends >= N
    assert len(steps) > 2  # decisions took different times


def test_a_limit_of_decisions_ends_an_episode_too():
    native, sync = pair(AutoresetMode.NEXT_STEP, limit=2)
    same(native.reset(seed=1), sync.reset(seed=1))
    for k in range(4):
        actions = np.array([0, 1, k])
        same(native.step(actions), sync.step(actions))


def test_it_is_so_without_autoreset_and_with_resets_of_some():
    native, sync = pair(AutoresetMode.DISABLED, budget=2.0)
    same(native.reset(seed=3), sync.reset(seed=3))
    rng = np.random.default_rng(0)
    for mask in ([True, False, True], [True, True, True]):
        over = np.zeros(N, np.bool_)
        while not over.all():
            actions = rng.integers(0, SLOTS, N)
            if over.any():
                options = {"reset_mask": over}
                mine, theirs = (e.reset(options=dict(options)) for e in (native, sync))
                same(mine, theirs)
            mine = native.step(actions)
            same(mine, sync.step(actions))
            over = mine[3]
        with pytest.raises(gym.error.ResetNeeded, match="are over"):
            native.step(np.zeros(N, np.int64))
        for which in (mask, [not one for one in mask]):
            if any(which):
                options = {"reset_mask": np.array(which)}
                mine, theirs = (e.reset(seed=8, options=dict(options)) for e in (native, sync))
                same(mine, theirs)


def test_episodes_of_a_split_are_those_of_single_environments():
    native, sync = pair(AutoresetMode.NEXT_STEP, budget=4.0)
    mine = native.reset(options={"split": "test", "index": [4, 5, 6]})
    alone = []
    for i, env in enumerate(sync.envs):
        alone.append(env.reset(options={"split": "test", "index": 4 + i}))
        for key, rows in mine[0].items():
            same(rows[i], alone[i][0][key])
    assert mine[1]["index"].tolist() == [4, 5, 6]
    stepped = native.step(np.array([1, 1, 0]))
    for i, env in enumerate(sync.envs):
        observation, reward, *_, info = env.step(np.int64([1, 1, 0][i]))
        assert reward == stepped[1][i]
        assert info["steps"] == stepped[4]["steps"][i]
        for key, rows in stepped[0].items():
            same(rows[i], observation[key])


def test_attributes_are_those_of_single_environments():
    native, sync = pair(AutoresetMode.NEXT_STEP, budget=20.0)
    with pytest.raises(gym.error.ResetNeeded):
        native.get_attr("options")
    for env in (native, sync):
        env.reset(seed=2)
        env.step(np.array([0, 1, 1]))
    for mine, theirs in zip(native.call("action_masks"), sync.call("action_masks"), strict=True):
        same(mine, theirs)
    for mine, theirs in zip(native.get_attr("options"), sync.get_attr("options"), strict=True):
        same(mine.planning.costmap.kinds, theirs.planning.costmap.kinds)
        assert mine.candidates == theirs.candidates
    slams = [env.unwrapped.patrol.slam for env in sync.envs]
    for mine, theirs in zip(native.get_attr("slam"), slams, strict=True):
        same(mine.map().occupied, theirs.map().occupied)


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
def test_a_copy_goes_on_as_the_original(copied):
    native, _ = pair(AutoresetMode.NEXT_STEP, budget=6.0)
    rng = np.random.default_rng(3)
    native.reset(seed=3)
    native.step(np.array([1, 2, 0]))
    twin = copied(native)
    for _ in range(4):
        actions = rng.integers(0, SLOTS, N)
        same(native.step(actions), twin.step(actions))


def test_threads_change_nothing():
    one, two = (gym.make_vec("DoorPatrolGoals-v0", N, threads=n, budget=4.0) for n in (1, 2))
    same(one.reset(seed=1), two.reset(seed=1))
    for _ in range(3):
        same(one.step(np.array([1, 0, 2])), two.step(np.array([1, 0, 2])))


@pytest.mark.parametrize(
    ("actions", "message"),
    [
        (np.array([0, SLOTS, 0]), "whole numbers from 0 to 8, got"),
        (np.array([0, -1, 0]), "whole numbers from 0 to 8"),
        (np.array([0.5, 1.0, 0.0]), "whole numbers from 0 to 8"),
        (np.array([0, 1]), r"3 whole numbers, got shape \(2,\)"),
    ],
)
def test_wrong_actions_are_refused_and_change_nothing(actions, message):
    native, sync = pair(AutoresetMode.NEXT_STEP)
    for env in (native, sync):
        env.reset(seed=0)
    with pytest.raises(InputError, match=message):
        native.step(actions)
    good = np.array([0, 1, 2])
    same(native.step(good), sync.step(good))


@pytest.mark.parametrize("wrong", [{"patience": 0.5}, {"budget": -4.0}, {"num_envs": 0},
                                   {"slam": "magic"}, {"hold": 3}])  # fmt: skip
def test_wrong_parameters_are_refused(wrong):
    with pytest.raises(InputError):
        DoorPatrolGoalsVectorEnv(**wrong)
