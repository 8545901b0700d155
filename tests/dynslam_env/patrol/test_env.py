import hashlib
import os
import subprocess
import sys
import warnings
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from dynslam_env import DoorWorldEnv, FinalScores, Laser, Layout, SlamWrapper, slam_run
from dynslam_env.patrol.doors_known import DoorsKnown
from dynslam_env.patrol.env import DoorPatrolEnv
from dynslam_env.patrol.patroller import Patroller
from dynslam_env.patrol.rewards import RewardTerms, RewardWeights
from slam import InputError, Pose2
from tests.dynslam_env.test_vector import same

TOLD = {"pose", "door_angles", "collision", "time", "slam", "door_brier"}


def made(**parameters) -> Any:
    return gym.make("DoorPatrol-v0", **parameters)


def drive(env, steps, seed=0) -> list[Any]:
    """Everything that is given back over some steps of driving at random."""
    rng, given = np.random.default_rng(seed), [env.reset(seed=seed)]
    for _ in range(steps):
        given.append(env.step(rng.uniform(-1, 1, 2).astype(np.float32)))
    return given


def digest(given) -> str:
    found = hashlib.sha256()
    for observation, *others in given:
        for key in sorted(observation):
            found.update(observation[key].tobytes())
        found.update(repr([x for x in others if not isinstance(x, dict)]).encode())
        found.update(repr(sorted(others[-1].get("reward_terms", {}).items())).encode())
    return found.hexdigest()


def test_gymnasiums_checker_has_no_complaint():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", message=".*(not copied|spec|render|out of date).*")
        check_env(made(max_episode_steps=5).unwrapped, skip_render_check=True)


def test_it_is_not_said_to_be_out_of_date():
    """DoorPatrol-v1 is another task."""
    code = "import gymnasium, dynslam_env; gymnasium.make('DoorPatrol-v0')"
    told = subprocess.run([sys.executable, "-W", "default", "-c", code], capture_output=True,
                          check=True, text=True)  # fmt: skip
    assert "out of date" not in told.stderr


def test_stable_baselines3s_checker_has_no_complaint():
    checker = pytest.importorskip("stable_baselines3.common.env_checker")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", message=".*out of date.*")  # there is a -v1
        checker.check_env(made(max_episode_steps=5))


def test_the_reward_is_the_sum_of_its_terms():
    for _, reward, terminated, truncated, info in drive(made(), 30)[1:]:
        assert set(info["reward_terms"]) == set(RewardTerms._fields)
        assert reward == sum(info["reward_terms"].values())
        assert not terminated
        assert not truncated


def test_what_is_not_named_is_not_paid():
    env = made(reward=RewardWeights({"distance": -1.0}))
    for _, reward, *_, info in drive(env, 5)[1:]:
        assert list(info["reward_terms"]) == ["distance"]
        assert reward <= 0.0


def test_infos_hold_what_they_are_said_to():
    given = drive(made(), 2)
    assert set(given[0][1]) == TOLD
    for step in given[1:]:
        assert set(step[4]) == TOLD | {"reward_terms"}
    assert given[-1][4]["time"] == pytest.approx(0.8)
    assert given[-1][4]["pose"].shape == (3,)
    assert given[-1][4]["door_angles"].shape == (8,)


def test_time_alone_ends_it():
    ends = [step[2:4] for step in drive(made(max_episode_steps=6), 6)[1:]]
    assert ends == [(False, False)] * 5 + [(False, True)]
    assert gym.spec("DoorPatrol-v0").max_episode_steps == 250


def test_a_collision_is_the_share_of_the_step():
    env = made()
    env.reset(seed=0)
    touched = [env.step(np.array([-1.0, 0.0], np.float32))[4]["collision"] for _ in range(10)]
    assert touched[0] == 0.0
    assert touched[-1] == 1.0
    assert set(touched) <= {0.0, 0.25, 0.5, 0.75, 1.0}


def test_the_same_seed_is_the_same_episode():
    once, used = drive(made(), 12, seed=3), made()
    drive(used, 5, seed=4)
    for env in (made(), used):
        same(tuple(once), tuple(drive(env, 12, seed=3)))


def test_the_same_seed_is_the_same_episode_in_another_process():
    code = (
        "from tests.dynslam_env.patrol.test_env import digest, drive, made\n"
        "print(digest(drive(made(), 12, seed=3)))"
    )
    path = os.pathsep.join(sys.path)
    told = subprocess.run(
        [sys.executable, "-c", code], env=os.environ | {"PYTHONPATH": path, "PYTHONHASHSEED": "1"},
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    assert told.stdout.split()[-1] == digest(drive(made(), 12, seed=3))


def test_other_seeds_are_other_episodes():
    assert len({digest(drive(made(), 3, seed=seed)) for seed in (1, 2, 3)}) == 3


class Poison:
    """The truth, where nobody may look at it: whatever is done with it raises."""

    def __getattribute__(self, name):
        raise AssertionError(f"the truth was looked at: {name}")

    __array__ = __iter__ = __len__ = __getitem__ = __add__ = __sub__ = __matmul__ = (
        lambda self, *given: pytest.fail("the truth was looked at")
    )


def test_no_truth_is_in_observation_or_reward(monkeypatch):
    expected = drive(made(), 25, seed=5)
    env = DoorPatrolEnv()  # no wrapper of Gymnasium's looks at the infos
    given: list[Any] = [env.reset(seed=5)]
    step = SlamWrapper.step

    def poisoned(self, action):
        _, *others, info = step(self, action)
        true = {"pose": Poison(), "door_angles": Poison(), "slam": Poison()}
        return Poison(), *others, info | true

    monkeypatch.setattr(SlamWrapper, "step", poisoned)
    monkeypatch.setattr(slam_run, "errors_of", lambda estimate, truth: {})
    monkeypatch.setattr(DoorsKnown, "brier", lambda self, memory, time, openings: 0.0)
    for truth in ("pose", "layout", "physics"):
        monkeypatch.setattr(DoorWorldEnv, truth, property(lambda self: Poison()))
    for truth in ("outline", "occupancy", "bound", "scene"):
        monkeypatch.setattr(DoorWorldEnv, truth, lambda self: Poison())
    rng = np.random.default_rng(5)
    given += [env.step(rng.uniform(-1, 1, 2).astype(np.float32)) for _ in range(25)]
    for mine, theirs in zip(given, expected, strict=True):
        same(mine[0], theirs[0])
    for mine, theirs in zip(given[1:], expected[1:], strict=True):
        assert mine[1] == theirs[1]
        assert mine[4]["reward_terms"] == theirs[4]["reward_terms"]


def test_the_trap_would_catch_who_looks(monkeypatch):
    env = made()
    env.reset(seed=0)
    monkeypatch.setattr(DoorWorldEnv, "pose", property(lambda self: Poison()))
    cheat = lambda self, *given: {"at": env.unwrapped.place.pose.x}  # noqa: E731
    monkeypatch.setattr(Patroller, "observation", cheat)
    monkeypatch.setattr(slam_run, "errors_of", lambda estimate, truth: {})
    with pytest.raises(AssertionError, match="the truth was looked at: x"):
        env.unwrapped.observation()


@pytest.mark.parametrize("action", [0.5, [0.5], [0.1, 0.2, 0.3], [[0.1, 0.2]]])
def test_actions_of_another_shape_are_refused(action):
    env = DoorPatrolEnv()
    env.reset(seed=0)
    with pytest.raises(InputError, match="actions are numbers from -1 to 1"):
        env.step(np.array(action, np.float32))


def test_an_action_that_is_no_number_is_refused_and_changes_nothing():
    env, other = DoorPatrolEnv(), DoorPatrolEnv()
    for one in (env, other):
        one.reset(seed=0)
    with pytest.raises(InputError, match="finite"):
        env.step(np.array([np.nan, 0.0], np.float32))
    action = np.array([0.5, 0.1], np.float32)
    same(env.step(action)[0], other.step(action)[0])


def test_there_is_no_patrol_before_a_reset():
    env = DoorPatrolEnv()
    for call in (env.snapshot, lambda: env.slam, lambda: env.step(np.zeros(2, np.float32))):
        with pytest.raises(gym.error.ResetNeeded):
            call()


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"slam": "magic"}, "unknown SLAM variant 'magic'; known"),
        ({"world": "moon"}, "moon"),
        ({"score_every": -1}, "score_every must be a whole number"),
        ({"score_every": 50}, "score_every must be a multiple of hold, got 50 and 4"),
        ({"hold": 3}, "hold must be a multiple of scan_every"),
    ],
)
def test_wrong_parameters_are_refused(wrong, message):
    with pytest.raises(InputError, match=message):
        DoorPatrolEnv(**wrong)


def test_the_slam_is_scored_if_asked_for():
    infos = [step[-1] for step in drive(made(score_every=8), 4)]
    assert ["f1_5cm" in info["slam"] for info in infos] == [True, False, True, False, True]


def test_the_last_step_of_a_time_limit_is_scored():
    env = FinalScores(gym.make("DoorPatrol-v0", score_every=8, max_episode_steps=3))
    env.reset(seed=0)
    infos = [env.step(np.zeros(2, np.float32))[-1] for _ in range(3)]
    assert ["f1_5cm" in info["slam"] for info in infos] == [False, True, True]


def test_it_runs_without_doors_and_with_few_beams():
    walls = np.array([(0, 0, 6, 0), (6, 0, 6, 4), (6, 4, 0, 4), (0, 4, 0, 0)], dtype=float)
    room = Layout(walls, (), Pose2(1.0, 2.0, 0.0), np.array([(3.0, 2.0)]))
    for beams in (2, 19, 361):
        given = drive(made(world=room, laser=Laser(beams=beams)), 3)
        assert np.isnan(given[-1][4]["door_brier"])
        assert given[-1][0] in made().observation_space


def test_one_beam_will_do():
    drive(made(laser=Laser(beams=1)), 5)


@pytest.mark.parametrize("name", ["DoorPatrol-v0", "DoorPatrol-v1", "DoorPatrolGoals-v0"])
def test_a_reset_draws_nothing_from_the_generator_that_agents_use_too(name):
    env = gym.make(f"dynslam_env:{name}").unwrapped
    env.reset(seed=3)
    fresh = np.random.default_rng(3).bit_generator.state
    assert env.np_random.bit_generator.state == fresh
