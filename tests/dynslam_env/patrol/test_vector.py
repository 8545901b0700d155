from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv

from dynslam_env import CarriedAway, Gap, Laser, Robot, Slip
from dynslam_env.patrol.rewards import RewardWeights
from dynslam_env.patrol.vector import DoorPatrolVectorEnv
from slam import InputError
from tests.dynslam_env.test_vector import same

N = 3
KINDS = {
    "corridor": {},
    "office": {"world": "office"},
    "crowd": {"world": "crowd"},
    "faulty": {"faults": [Gap(0.9, at=0.7), CarriedAway(distance=0.02, at=0.5), Slip(at=1.0)]},
    "sparse": {"slam": "static-ml", "scan_every": 4,
               "faults": [Gap(0.9, at=0.7), CarriedAway(distance=0.02, at=0.5), Slip(at=1.0)]},
    "other": {"slam": "static-ml", "hold": 3, "scan_every": 3,
              "reward": RewardWeights({"pose": 1.0}), "laser": Laser(beams=31, dropout=0.2),
              "robot": Robot(acceleration=5.0)},
}  # fmt: skip


def pair(mode, limit, **parameters) -> tuple[Any, Any]:
    def single():
        return gym.make("DoorPatrol-v0", max_episode_steps=limit, **parameters)

    native = gym.make_vec(
        "DoorPatrol-v0", N, max_episode_steps=limit, autoreset_mode=mode, **parameters
    )
    return native, SyncVectorEnv([single] * N, autoreset_mode=mode)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
def test_it_is_n_single_patrols_bit_for_bit(mode, kind):
    native, sync = pair(mode, 7, **KINDS[kind])
    rng, ends, touched = np.random.default_rng(1), 0, 0.0
    same(native.reset(seed=5), sync.reset(seed=5))
    for _ in range(18):
        actions = rng.uniform(-1.2, 1.2, (N, 2)).astype(np.float32)
        actions[0] = -1.0, 0.0  # into the wall behind
        mine, theirs = native.step(actions), sync.step(actions)
        same(mine, theirs)
        ends += int((mine[2] | mine[3]).sum())
        touched = max(touched, mine[4]["collision"][0])
    assert ends == 2 * N
    assert touched > 0.0 or kind == "office"


def test_it_is_so_without_autoreset_and_with_resets_of_some():
    native, sync = pair(AutoresetMode.DISABLED, 4)
    same(native.reset(seed=3), sync.reset(seed=3))
    rng = np.random.default_rng(0)
    for mask in ([True, False, True], [False, True, False], [True, True, True]):
        while not (native._steps >= 4).any():
            actions = rng.uniform(-1, 1, (N, 2)).astype(np.float32)
            same(native.step(actions), sync.step(actions))
        with pytest.raises(gym.error.ResetNeeded, match="are over"):
            native.step(np.zeros((N, 2), np.float32))
        for which in (mask, [not one for one in mask]):
            if any(which):
                options = {"reset_mask": np.array(which)}
                mine, theirs = (e.reset(seed=8, options=dict(options)) for e in (native, sync))
                same(mine, theirs)


def test_attributes_are_those_of_single_patrols():
    native, sync = pair(AutoresetMode.NEXT_STEP, 9)
    for env in (native, sync):
        env.reset(seed=2)
        env.step(np.full((N, 2), 0.4, np.float32))
    for name in ("limits", "period", "robot", "time"):
        assert native.get_attr(name) == sync.get_attr(name)
    assert native.call("door_beliefs") == sync.call("door_beliefs")
    for mine, theirs in zip(native.call("snapshot"), sync.call("snapshot"), strict=True):
        same(mine.scan.ranges, theirs.scan.ranges)
        same(mine.map.occupied, theirs.map.occupied)
        same(mine.beliefs.age, theirs.beliefs.age)
    for mine, theirs in zip(native.get_attr("slam"), sync.get_attr("slam"), strict=True):
        same(mine.pose, theirs.pose)
        same(mine.map().occupied, theirs.map().occupied)
    for mine, theirs in zip(native.call("patroller"), sync.call("patroller"), strict=True):
        same(mine.estimate.covariance, theirs.estimate.covariance)


def test_threads_change_nothing():
    one, two = (gym.make_vec("DoorPatrol-v0", N, threads=n, max_episode_steps=5) for n in (1, 2))
    same(one.reset(seed=1), two.reset(seed=1))
    for _ in range(8):
        actions = np.random.default_rng(0).uniform(-1, 1, (N, 2)).astype(np.float32)
        same(one.step(actions), two.step(actions))


def test_what_is_given_back_owns_its_memory():
    native, _ = pair(AutoresetMode.SAME_STEP, 3)
    observation, info = native.reset(seed=0)
    kept = [rows.copy() for rows in (*observation.values(), info["door_brier"], info["collision"])]
    for _ in range(4):
        native.step(np.ones((N, 2), np.float32))
    for a, b in zip((*observation.values(), info["door_brier"], info["collision"]), kept,
                    strict=True):  # fmt: skip
        same(a, b)


def test_observations_are_in_their_space():
    native, _ = pair(AutoresetMode.NEXT_STEP, 5)
    assert native.reset(seed=0)[0] in native.observation_space
    for _ in range(8):
        assert native.step(native.action_space.sample())[0] in native.observation_space


@pytest.mark.parametrize(
    ("actions", "message"),
    [
        (np.zeros((2, 2), np.float32), r"of shape \(3, 2\), got float32 of shape \(2, 2\)"),
        (np.zeros(2, np.float32), r"of shape \(3, 2\)"),
        (np.array([[0, 0], [0, np.nan], [0, 0]], np.float32), "finite numbers from -1 to 1"),
        (np.full((3, 2), "left"), r"of shape \(3, 2\)"),
    ],
)
def test_wrong_actions_are_refused_and_change_nothing(actions, message):
    native, sync = pair(AutoresetMode.NEXT_STEP, 9)
    for env in (native, sync):
        env.reset(seed=0)
    with pytest.raises(InputError, match=message):
        native.step(actions)
    good = np.full((N, 2), 0.3, np.float32)
    same(native.step(good), sync.step(good))


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"num_envs": 0}, "num_envs must be a whole number of at least 1"),
        ({"slam": "magic"}, "unknown SLAM variant 'magic'"),
        ({"hold": 3}, "hold must be a multiple of scan_every"),
        ({"world": "moon"}, "moon"),
    ],
)
def test_wrong_parameters_are_refused(wrong, message):
    with pytest.raises(InputError, match=message):
        DoorPatrolVectorEnv(**wrong)


def test_there_are_no_patrols_before_a_reset():
    native, _ = pair(AutoresetMode.NEXT_STEP, 5)
    with pytest.raises(gym.error.ResetNeeded):
        native.step(np.zeros((N, 2), np.float32))
