"""The native vector form of SlamWrapper gives what n wrapped environments give."""

import copy
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv

from dynslam_env import Gap, SlamVectorEnv, SlamWrapper
from slam import InputError
from tests.dynslam_env.test_vector import same

LIMIT, STEPS, COUNT = 7, 16, 3
ACTIONS = np.random.default_rng(1).uniform(-0.4, 1.0, (STEPS, COUNT, 2)).astype(np.float32)
SEEN = {"map_crop": 2.0, "pose_estimate": True}


def single(name, parts, slam, **keywords):
    env = gym.make(name, max_episode_steps=LIMIT, **parts)
    return SlamWrapper(env, slam, score_every=0, **keywords)


def pair(mode, slam="dynamic-ml", name="DoorCorridor-v0", parts: Any = None, **keywords):
    parts = parts or {}
    mine = SlamVectorEnv.make(name, COUNT, slam=slam, max_episode_steps=LIMIT,
                              autoreset_mode=mode, **parts, **keywords)  # fmt: skip
    makers = [lambda: single(name, parts, slam, **keywords)] * COUNT
    return mine, SyncVectorEnv(makers, autoreset_mode=mode)


@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
@pytest.mark.parametrize(
    ("slam", "keywords"),
    [
        ("dynamic-ml", SEEN),
        ("hmm-graph", SEEN | {"scan_every": 3}),
        ("static-ml", {"parts": {"faults": [Gap(0.3, at=0.4)]}}),
    ],
)
def test_everything_is_that_of_single_environments(mode, slam, keywords):
    mine, theirs = pair(mode, slam, **keywords)
    assert mine.observation_space == theirs.observation_space
    same(mine.reset(seed=5), theirs.reset(seed=5))
    for actions in ACTIONS:
        same(mine.step(actions), theirs.step(actions))


def test_the_slam_of_each_world_can_be_asked_for():
    env = SlamVectorEnv.make("DoorOffice-v0", 2, slam="static-ml")
    with pytest.raises(gym.error.ResetNeeded):
        env.get_attr("slam")
    _, infos = env.reset(seed=0)
    slams = env.get_attr("slam")
    assert slams[0] is not slams[1]
    np.testing.assert_array_equal([one.pose for one in slams], infos["pose"])
    np.testing.assert_array_equal(infos["slam"]["position_error"], 0.0)
    assert env.call("estimate")[1].pose == slams[1].pose
    spec = gym.spec("DoorOffice-v0")
    assert env._config.limit == spec.max_episode_steps


def test_a_copy_goes_on_as_the_original():
    env, _ = pair(AutoresetMode.NEXT_STEP, **SEEN)
    env.reset(seed=3)
    for actions in ACTIONS[:4]:
        env.step(actions)
    twin = copy.deepcopy(env)
    for actions in ACTIONS[4:]:
        same(env.step(actions), twin.step(actions))


def test_patrols_and_unknown_variants_are_refused():
    with pytest.raises(InputError, match=r"needs an id of dynslam_env.WORLDS, got 'DoorPatrol-v0'"):
        SlamVectorEnv.make("DoorPatrol-v0", 2)
    with pytest.raises(InputError, match="dynamicml"):
        SlamVectorEnv.make("DoorCorridor-v0", 2, slam="dynamicml")
