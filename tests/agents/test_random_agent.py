import gymnasium as gym

from agents import RandomAgent
from dynslam_env import record


def test_its_actions_are_allowed_and_repeatable():
    env = gym.make("DoorCorridor-v0")
    first, second = (RandomAgent(env.action_space, seed=1).predict()[0] for _ in range(2))
    assert first in env.action_space
    assert first.tolist() == second.tolist()


def test_it_can_be_recorded():
    env = gym.make("DoorCorridor-v0", max_episode_steps=20)
    first, second = (record(env, RandomAgent(env.action_space, seed=0), seed=0) for _ in range(2))
    assert len(first.scans) == 21
    assert first.truth is not None
    assert second.truth is not None
    assert first.truth.poses.tobytes() == second.truth.poses.tobytes()
