"""Episodes of the named splits: the same everywhere, and none of them anywhere else."""

import hashlib
import json
import os
import subprocess
import sys
from itertools import product
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, SyncVectorEnv

import dynslam_env
from dynslam_env import SlamWrapper
from dynslam_env.reset_options import DIFFICULTIES, episode_options, options_of_each
from dynslam_env.splits import SPLITS, SplitEpisode
from slam import InputError

IDS = (*dynslam_env.WORLDS, *dynslam_env.PATROLS)
TEST_17 = {"split": "test", "index": 17}
WALK = np.random.default_rng(0).uniform(-0.3, 0.6, (12, 2)).astype(np.float32)
KNOWN = {
    "DoorCorridor-v0": "6ae3f4e75d7b",
    "DoorLoop-v0": "2402e10b23c7",
    "DoorOffice-v0": "be9c1801b736",
    "DoorCrowd-v0": "38eecf4fcae2",
    "DoorWings-v0": "d388ef44167b",
}
"""Digests of world test 17, to the millimetre: they are worlds that papers cite."""


def digest(env: Any) -> str:
    """Of the layout and the first state, to the millimetre (libraries differ in the last bit)."""
    world = env.unwrapped
    parts = (world.layout.walls, world.layout.path, world.outline(), *world.layout.routes)
    rounded = [(np.round(part, 3) + 0.0).tolist() for part in parts]
    return hashlib.sha256(json.dumps(rounded).encode()).hexdigest()[:12]


def drive(env: Any) -> list[Any]:
    """What an episode of the split gives: sensors, rewards, infos."""
    observation, info = env.reset(options=TEST_17)
    seen = [observation["odometry"], observation["scan"], info["pose"]]
    for action in WALK:
        observation, reward, *_, info = env.step(action)
        seen += [*observation.values(), reward, info["people"], info["door_angles"]]
    return seen


def same(mine, theirs):
    assert len(mine) == len(theirs)
    for a, b in zip(mine, theirs, strict=True):
        np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize("name", KNOWN)
def test_the_worlds_of_a_split_are_those_that_were_published(name):
    env = gym.make(name)
    env.reset(options=TEST_17)
    assert digest(env) == KNOWN[name]


def test_another_process_has_the_same_worlds():
    code = (
        "import gymnasium as gym\n"
        "from tests.dynslam_env.test_splits import TEST_17, digest\n"
        "for difficulty in ('easy', 'medium', 'hard'):\n"
        "    env = gym.make('DoorOffice-v0', difficulty=difficulty)\n"
        "    env.reset(seed=5), env.reset(options=TEST_17)\n"
        "    print(digest(env))\n"
    )
    hashed = os.environ | {"PYTHONHASHSEED": "7"}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=hashed)
    mine = []
    for difficulty in DIFFICULTIES:
        env = gym.make("DoorOffice-v0", difficulty=difficulty)
        env.reset(options=TEST_17)
        mine.append(digest(env))
    assert done.stdout.split() == mine, done.stderr


@pytest.mark.parametrize("name", dynslam_env.WORLDS)
def test_an_episode_repeats_whatever_was_before(name):
    first, second = gym.make(name), gym.make(name)
    second.reset(seed=3)
    second.step(WALK[0])
    same(drive(first), drive(second))
    same(drive(first), drive(second))


def test_the_environments_own_stream_goes_on_as_if_nothing_had_been():
    plain, mixed = gym.make("DoorOffice-v0"), gym.make("DoorOffice-v0")
    plain.reset(seed=3)
    mixed.reset(seed=3)
    mixed.reset(options=TEST_17)
    _, mine = plain.reset()
    _, theirs = mixed.reset()
    same([mine["pose"], mine["door_angles"]], [theirs["pose"], theirs["door_angles"]])
    assert "split" not in theirs


@pytest.mark.parametrize("name", [name for name in KNOWN if name != "DoorCrowd-v0"])
def test_no_two_episodes_of_splits_or_seeds_are_alike(name):
    env, seen = gym.make(name), set()
    asked = [{"split": split, "index": index} for split, index in product(SPLITS, range(12))]
    for options in asked:
        env.reset(options=options)
        seen.add(digest(env))
    for seed in range(12):
        env.reset(seed=seed)
        seen.add(digest(env))
    assert len(seen) == len(asked) + 12


def test_streams_of_splits_and_seeds_are_apart_by_construction():
    """The spawn key of a stream of a split begins with split and index; of a seed it has one
    number."""
    keys = set()
    for split, index in product(SPLITS, (0, 1, 2**32 - 1)):
        for child in SplitEpisode(split, index).rng().spawn(5):
            sequence: Any = child.bit_generator.seed_seq
            assert len(sequence.spawn_key) == 3
            keys.add((sequence.entropy, sequence.spawn_key))
    assert len(keys) == 3 * 3 * 5
    seeded: Any = seeding.np_random(3)[0].spawn(1)[0].bit_generator.seed_seq
    assert len(seeded.spawn_key) == 1


def test_info_tells_split_and_index():
    env = gym.make("DoorCorridor-v0")
    _, info = env.reset(options=TEST_17)
    assert (info["split"], info["index"]) == ("test", 17)
    *_, info = env.step(WALK[0])
    assert (info["split"], info["index"]) == ("test", 17)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"split": "tset", "index": 0}, "'train', 'validation', 'test', got 'tset'; did you mean"),
        ({"split": "test", "index": -1}, "whole number of at least 0, got -1"),
        ({"split": "test", "index": 2**32}, r"from 0 to 4\.29497e\+09"),
        ({"split": "test", "index": 1.0}, "whole number of at least 0, got 1.0"),
        ({"split": "test", "index": True}, "whole number of at least 0, got True"),
        ({"split": "test"}, "are given together"),
        ({"index": 3}, "are given together"),
        ({"difficulty": "harder"}, "'easy', 'medium', 'hard', got 'harder'; did you mean 'hard'"),
    ],
)
def test_what_is_no_episode_of_a_split(options, message):
    with pytest.raises(InputError, match=message):
        episode_options(options)


@pytest.mark.parametrize("name", IDS)
def test_a_seed_beside_a_split_is_refused(name):
    with pytest.raises(InputError, match="has no seed: split 'test' and index 17 say all"):
        gym.make(name).reset(seed=0, options=TEST_17)


def test_each_world_of_a_vector_has_an_index():
    _, asked = options_of_each({"split": "train", "index": [4, np.int64(2)]}, [None, None])
    assert [one.place for one in asked] == [SplitEpisode("train", 4), SplitEpisode("train", 2)]
    with pytest.raises(InputError, match="must be one number or 3, got 2"):
        options_of_each({"split": "train", "index": [4, 2]}, [None] * 3)
    with pytest.raises(InputError, match="has no seed"):
        options_of_each({"split": "train", "index": [4, 2]}, [None, 5])


@pytest.mark.parametrize("name", dynslam_env.WORLDS)
def test_a_vector_environment_has_the_worlds_of_the_single_one(name):
    native: Any = gym.make_vec(name, 3)
    observations, infos = native.reset(options={"split": "test", "index": [3, 17, 4]})
    alone = gym.make(name)
    observation, info = alone.reset(options=TEST_17)
    for action in WALK:
        np.testing.assert_array_equal(observations["scan"][1], observation["scan"])
        angles = infos["door_angles"][1]  # as long as those of the world with most doors
        np.testing.assert_array_equal(angles[~np.isnan(angles)], info["door_angles"])
        np.testing.assert_array_equal(infos["people"][1], info["people"])
        assert infos["split"].tolist() == ["test"] * 3
        assert infos["index"].tolist() == [3, 17, 4]
        observations, *_, infos = native.step(np.tile(action, (3, 1)))
        observation, *_, info = alone.step(action)


def test_infos_are_those_of_gymnasiums_own_vector_environment():
    native: Any = gym.make_vec("DoorCorridor-v0", 2, max_episode_steps=3)
    limited = [lambda: gym.make("DoorCorridor-v0", max_episode_steps=3)] * 2
    sync = SyncVectorEnv(limited, autoreset_mode=AutoresetMode.NEXT_STEP)
    for env in (native, sync):
        env.reset(seed=0)
    _, mine = native.reset(options=TEST_17)
    _, theirs = sync.reset(options=TEST_17)
    for _ in range(5):
        for key in ("split", "index", "_split", "_index"):
            assert (key in mine) == (key in theirs)
            np.testing.assert_array_equal(mine.get(key), theirs.get(key))
        *_, mine = native.step(np.zeros((2, 2), np.float32))
        *_, theirs = sync.step(np.zeros((2, 2), np.float32))


def test_worlds_with_and_without_a_split_side_by_side():
    env: Any = gym.make_vec("DoorCorridor-v0", 2)
    env.reset(seed=0)
    mask = np.array([False, True])
    env.reset(options={**TEST_17, "reset_mask": mask})
    *_, infos = env.step(np.zeros((2, 2), np.float32))
    assert infos["split"].tolist() == [None, "test"]
    assert infos["_index"].tolist() == [False, True]


def test_tasks_pass_the_split_on():
    wrapped = SlamWrapper(gym.make("DoorCorridor-v0"), score_every=0)
    _, info = wrapped.reset(options=TEST_17)
    assert info["split"] == "test"
    for name in dynslam_env.PATROLS:
        _, info = gym.make(name).reset(options=TEST_17)
        assert (info["split"], info["index"]) == ("test", 17)


def test_goals_of_a_split_repeat():
    def rewards(env):
        observation, _ = env.reset(options=TEST_17)
        found = []
        for _ in range(3):
            action = np.flatnonzero(observation["action_mask"])[-1]
            observation, reward, *_ = env.step(action)
            found.append(reward)
        return found

    env = gym.make("DoorPatrolGoals-v0")
    env.reset(seed=1)
    assert rewards(env) == rewards(gym.make("DoorPatrolGoals-v0"))


def test_difficulty_as_keyword_and_as_option_are_the_same_world():
    keyword, option = gym.make("DoorOffice-v0", difficulty="hard"), gym.make("DoorOffice-v0")
    keyword.reset(options=TEST_17)
    option.reset(options={**TEST_17, "difficulty": "hard"})
    assert digest(keyword) == digest(option)
    plain = gym.make("DoorOffice-v0")
    plain.reset(seed=4)
    option.reset(seed=4)
    assert digest(plain) == digest(option)  # of that one episode only
    assert digest(plain) != digest(keyword)


def test_worlds_of_unequal_numbers_of_doors_step_together():
    env: Any = gym.make_vec("DoorPatrol-v0", 3, difficulty="hard")
    _, infos = env.reset(options={"split": "test", "index": [0, 1, 2]})
    counts = [len(world.openings) for world in env.unwrapped.physics]
    assert len(set(counts)) > 1
    assert np.isfinite(infos["door_angles"]).sum(axis=1).tolist() == counts
    for i in range(3):
        alone = gym.make("DoorPatrol-v0", difficulty="hard")
        _, info = alone.reset(options={"split": "test", "index": i})
        assert infos["door_brier"][i] == info["door_brier"]


def test_a_world_of_ones_own_has_no_difficulty():
    layout = dynslam_env.Corridor().layout(np.random.default_rng(0))
    with pytest.raises(
        InputError, match="difficulty varies a Corridor, a Loop, an Office or Wings"
    ):
        gym.make("DoorCorridor-v0", world=layout, difficulty="easy")
