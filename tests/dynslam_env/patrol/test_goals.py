import math
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from dynslam_env import DoorWorldEnv
from dynslam_env.navigation.follower import GOAL_TOLERANCE, HEADING_TOLERANCE
from dynslam_env.patrol.env import DoorPatrolEnv
from dynslam_env.patrol.goal_options import FRONTIER_SLOTS, SLOTS
from dynslam_env.patrol.goals import DoorPatrolGoalsEnv
from slam import InputError

TRUTH = ("pose", "layout", "physics", "outline", "occupancy", "bound")


def begun(seed=0, **parameters):
    env: Any = gym.make("DoorPatrolGoals-v0", **parameters).unwrapped
    observation, _ = env.reset(seed=seed)
    return env, observation


def masked(rng, observation):
    return rng.choice(np.flatnonzero(observation["action_mask"]))


def driven(env, observation, choose):
    """(observation, reward, info) of each decision of an episode."""
    rows, over = [], False
    while not over:
        observation, reward, _, over, info = env.step(choose(observation))
        rows.append((observation, reward, info))
    return rows


def door_first(observation):
    """The door unseen longest, else the nearest frontier, else a look around."""
    return next((a for a in (1 + FRONTIER_SLOTS, 1) if observation["action_mask"][a]), 0)


def test_gymnasiums_checks():
    check_env(begun(budget=8.0)[0], skip_render_check=True)


def test_the_end_of_the_budget_is_scored():
    env, observation = begun(seed=2, budget=6.0, score_every=400)
    rows = driven(env, observation, door_first)
    scored = ["f1_5cm" in info["slam"] for _, _, info in rows]
    assert scored == [False] * (len(rows) - 1) + [True]


def test_what_is_observed_lies_in_the_space_and_the_mask_is_what_is_present():
    env, observation = begun(seed=2)
    for _ in range(10):
        assert env.observation_space.contains(observation)
        assert observation["action_mask"].tolist() == env.action_masks().tolist()
        assert observation["goals"][:, 0].tolist() == observation["action_mask"].tolist()
        assert observation["action_mask"][0]
        observation, *_ = env.step(door_first(observation))


def test_to_look_around_turns_on_the_spot():
    env, _ = begun()
    before = env.patrol.slam.pose
    *_, info = env.step(0)
    after = env.patrol.slam.pose
    assert info["reached"]
    assert math.dist(before[:2], after[:2]) < 0.1
    turned = math.remainder(after.theta - before.theta, math.tau) % math.tau
    assert turned == pytest.approx(math.radians(170), abs=HEADING_TOLERANCE + 0.1)


@pytest.mark.parametrize("seed", [0, 1])
def test_a_frontier_or_a_door_that_was_reached_is_stood_at_and_looked_at(seed):
    env, observation = begun(seed, patience=20.0)
    kinds = set()
    for _ in range(25):
        action = door_first(observation)
        options, door = env.options, action > FRONTIER_SLOTS
        goal = options.chosen(action).goal
        observation, _, _, over, info = env.step(action)
        if info["reached"] and action:
            pose, (x, y) = env.patrol.slam.pose, options.planning.centre(goal.cell)
            assert math.dist(pose[:2], (x, y)) < GOAL_TOLERANCE + 0.3
            assert (
                abs(math.remainder(pose.theta - goal.heading, math.tau)) < HEADING_TOLERANCE + 0.1
            )
            kinds.add(door)
            if door:
                away = np.subtract(goal.target, pose[:2])
                bearing = math.atan2(away[1], away[0]) - pose.theta
                assert abs(math.remainder(bearing, math.tau)) < 0.7
        if over:
            break
    assert kinds == {True, False}


def test_an_empty_slot_looks_around():
    (one, shown), (other, _) = begun(), begun()
    assert not shown["action_mask"][SLOTS - 1]
    first, second = one.step(SLOTS - 1), other.step(0)
    assert first[1] == second[1]
    assert all((first[0][key] == second[0][key]).all() for key in first[0])


def test_the_reward_is_the_sum_of_the_patrols(monkeypatch):
    env, observation = begun(seed=3, budget=40.0)
    given, advance = [], DoorPatrolEnv.advance
    with monkeypatch.context() as patch:
        patch.setattr(
            DoorPatrolEnv, "advance", lambda self, a: (given.append(a), advance(self, a))[1]
        )
        rows = driven(env, observation, door_first)
    patrol: Any = gym.make("DoorPatrol-v0")
    patrol.reset(seed=3)
    steps = iter([patrol.step(action) for action in given])
    for shown, reward, info in rows:
        mine = [next(steps) for _ in range(info["steps"])]
        assert reward == sum(row[1] for row in mine)
        for name, total in info["reward_terms"].items():
            assert total == sum(row[4]["reward_terms"][name] for row in mine)
        assert info["door_brier"] == pytest.approx(np.mean([row[4]["door_brier"] for row in mine]))
        assert info["collision"] == pytest.approx(np.mean([row[4]["collision"] for row in mine]))
        assert info["time"] == mine[-1][4]["time"]
        assert all((shown[key] == mine[-1][0][key]).all() for key in mine[-1][0])
    assert next(steps, None) is None


def test_a_decision_ends_with_patience_and_an_episode_with_the_budget():
    env, observation = begun(patience=2.0, budget=9.2)
    rows = driven(env, observation, door_first)
    steps = [info["steps"] for *_, info in rows]
    assert sum(steps) == 23
    assert max(steps) == 5
    assert rows[-1][2]["time"] == pytest.approx(9.2)
    others = [info for *_, info in rows[:-1] if info["steps"] < 5]
    assert any(info["reached"] for info in others)


@pytest.mark.parametrize("wrong", [{"patience": 0.5}, {"patience": 0.0}, {"budget": -4.0},
                                   {"budget": 100.1}, {"slam": "none"}, {"hold": 3}])  # fmt: skip
def test_wrong_arguments_are_refused(wrong):
    with pytest.raises(InputError):
        DoorPatrolGoalsEnv(**wrong)


@pytest.mark.parametrize("wrong", [SLOTS, -1, 1.5])
def test_wrong_actions_are_refused(wrong):
    with pytest.raises(InputError, match="whole numbers from 0 to 8"):
        begun()[0].step(wrong)


def test_the_same_seed_is_the_same_episode():
    episodes = []
    for _ in range(2):
        env, observation = begun(seed=5, budget=40.0, world="crowd")
        rng = np.random.default_rng(0)
        episodes.append(driven(env, observation, lambda seen, rng=rng: masked(rng, seen)))
    for (shown, reward, _), (other, same, _) in zip(*episodes, strict=True):
        assert reward == same
        assert all(shown[key].tobytes() == other[key].tobytes() for key in shown)


def test_nobody_looks_at_the_truth(monkeypatch):
    """Whatever tells it of the world is a trap, but while the world itself moves on."""
    moving = [False]

    def trapped(key):
        true = getattr(DoorWorldEnv, key)
        read = true.fget if isinstance(true, property) else None

        def get(self):
            assert moving[0], f"{key} was read"
            return read(self) if read else true.__get__(self)

        return property(get)

    def let(name):
        true = getattr(DoorPatrolEnv, name)

        def run(self, *args, **keywords):
            moving[0] = True
            try:
                return true(self, *args, **keywords)
            finally:
                moving[0] = False

        return run

    for name in ("__init__", "reset", "advance"):
        monkeypatch.setattr(DoorPatrolEnv, name, let(name))
    for key in TRUTH:
        monkeypatch.setattr(DoorWorldEnv, key, trapped(key))
    env, observation = begun(seed=1, budget=40.0)
    driven(env, observation, door_first)
    with pytest.raises(AssertionError, match="pose was read"):
        _ = env.patrol.place.pose


@pytest.mark.parametrize("world", ["corridor", "office"])
def test_any_choice_can_be_driven(world):
    env, observation = begun(seed=4, world=world)
    rng = np.random.default_rng(0)
    rows = driven(env, observation, lambda seen: masked(rng, seen))
    assert sum(info["steps"] for *_, info in rows) == 250
    assert np.isfinite([reward for _, reward, _ in rows]).all()


@pytest.mark.parametrize("algorithm", ["PPO", "MaskablePPO"])
def test_it_can_be_learned_on(algorithm):
    baselines = pytest.importorskip("stable_baselines3")
    contrib = pytest.importorskip("sb3_contrib")
    from stable_baselines3.common.env_checker import check_env as their_check
    from stable_baselines3.common.env_util import make_vec_env

    their_check(begun(budget=8.0)[0])
    envs = make_vec_env("DoorPatrolGoals-v0", 2, seed=0, env_kwargs={"budget": 8.0})
    kind = getattr(baselines if algorithm == "PPO" else contrib, algorithm)
    model = kind("MultiInputPolicy", envs, n_steps=4, batch_size=8, n_epochs=1, seed=0)
    model.learn(16)
    assert model.num_timesteps == 16
