import inspect
from typing import Any

import gymnasium as gym
import numpy as np
import pytest

import agents
import dynslam_env
from dynslam_env import DoorWorldEnv, Layout
from slam import Pose2

BOX: Any = [(0, 0, 6, 0), (6, 0, 6, 4), (6, 4, 0, 4), (0, 4, 0, 0), (3, 0, 3, 1.5), (3, 2.5, 3, 4)]
WAY: Any = [(1.5, 2.0), (4.5, 2.0)]
DOOR = dynslam_env.Door((3.0, 1.55), np.pi / 2, -1, 0.9, 0.04)
BY_HAND = Layout(BOX, (DOOR,), Pose2(1.5, 2.0, 0.0), WAY)
WORLDS = {"corridor": "corridor", "loop": "loop", "office": "office", "crowd": "crowd",
          "by hand": BY_HAND}  # fmt: skip
TRUTH = ("pose", "layout", "physics", "outline", "occupancy", "bound")
SHOWN = {
    "oracle": {"layout", "physics"}, "scripted-path": {"layout"}, "best-place": {"layout"},
    "planning-oracle": {"layout"},
}  # fmt: skip


def patrol(world="corridor", seed=0):
    """An episode that has begun, and what is observed."""
    env = gym.make("DoorPatrol-v0", world=WORLDS[world], max_episode_steps=10_000)
    observation, _ = env.reset(seed=seed)
    return env, observation


STEPS = 40  # 16 s


def driven(name, world="corridor", steps=STEPS, seed=0):
    """The actions, and the true poses."""
    env, observation = patrol(world, seed)
    agent, actions, poses = agents.make(name, env, seed), [], []
    for _ in range(steps):
        action, _ = agent.predict(observation)
        observation, _, _, _, info = env.step(action)
        actions.append(action)
        poses.append(info["pose"])
    return np.array(actions), np.array(poses)


@pytest.mark.parametrize("world", WORLDS)
@pytest.mark.parametrize("name", agents.names())
def test_every_agent_drives_in_every_world(name, world):
    actions, poses = driven(name, world)
    assert actions.dtype == np.float32
    assert actions.shape == (STEPS, 2)
    assert (np.abs(actions) <= 1.0).all()
    moved = np.hypot(*np.diff(poses[:, :2], axis=0).T).sum()
    turned = np.abs(np.diff(np.unwrap(poses[:, 2]))).sum()
    assert moved > 0.5 or turned > 2.0


@pytest.mark.parametrize("name", agents.names())
def test_the_same_seed_is_the_same_drive(name):
    first, second = (driven(name, "crowd", 40, seed=3)[0] for _ in range(2))
    assert first.tobytes() == second.tobytes()


@pytest.mark.parametrize("name", agents.names())
def test_nobody_looks_at_the_truth(name, monkeypatch):
    """Whatever tells it of the world is a trap while an agent thinks."""
    (env, observation), asked = patrol(), set()
    thinking = [True]
    for key in TRUTH:
        monkeypatch.setattr(DoorWorldEnv, key, trap(key, asked, thinking))
    agent = agents.make(name, env, 0)
    for _ in range(40):
        thinking[0] = True
        action, _ = agent.predict(observation)
        thinking[0] = False
        observation, *_ = env.step(action)
    assert asked == SHOWN.get(name, set())


def trap(key, asked, thinking):
    """The attribute as it was; who reads it while an agent thinks is taken down."""
    true = inspect.getattr_static(DoorWorldEnv, key)
    read = true.fget if isinstance(true, property) else None

    def get(self):
        if thinking[0]:
            asked.add(key)
        return read(self) if read else true.__get__(self)

    return property(get)


READS = {"random": [], "ppo": [], "oracle": ["place", "snapshot"]}


class Recorded:
    """Records what is read of an environment."""

    def __init__(self, env):
        self.env, self.reads = env, []

    def __getattr__(self, name):
        self.reads.append(name)
        return getattr(self.env, name)


@pytest.mark.parametrize("name", agents.names())
def test_a_decision_reads_one_snapshot_of_the_environment(name):
    env, observation = patrol("crowd")
    seen = Recorded(env.unwrapped)
    shown: Any = Shown(seen)
    agent: Any = agents.make(name, shown, 0)
    every = set()
    for _ in range(40):
        seen.reads.clear()
        action, _ = agent.predict(observation)
        assert seen.reads.count("snapshot") == ("snapshot" in READS.get(name, ["snapshot"]))
        every.update(seen.reads)
        assert len(seen.reads) == len(set(seen.reads))
        observation, *_ = env.step(action)
    assert sorted(every) == READS.get(name, ["snapshot"])


class Shown:
    """An environment whose `unwrapped` is recorded."""

    def __init__(self, recorded):
        self.unwrapped = recorded
        self.observation_space = recorded.env.observation_space
        self.action_space = recorded.env.action_space


def test_the_maps_of_a_snapshot_are_read_before_the_next_step():
    env: Any = patrol()[0].unwrapped
    snapshot, early = env.snapshot(), env.snapshot()
    assert early.map is early.map
    env.step(np.zeros(2, np.float32))
    assert early.map is not None  # it was read in time
    for read in (lambda: snapshot.map, lambda: snapshot.beliefs):
        with pytest.raises(RuntimeError, match="before the environment's step"):
            read()
    with pytest.raises(AttributeError):
        snapshot.time = 1.0


def test_a_snapshot_is_what_the_slam_and_the_dynamic_map_hold():
    env: Any = patrol(seed=3)[0].unwrapped
    for _ in range(5):
        env.step(np.array([0.5, 0.3], np.float32))
    snapshot, grid = env.snapshot(), env.slam.map()
    beliefs = env.patroller.memory.beliefs(env.time)
    assert snapshot.time == env.time == pytest.approx(2.0)
    assert snapshot.pose == Pose2.of(env.slam.pose)
    assert snapshot.covariance is env.patroller.estimate.covariance
    assert (snapshot.limits, snapshot.period) == ((0.8, 1.5), 0.4)
    np.testing.assert_array_equal(snapshot.scan.ranges, env.place.scan.ranges)
    np.testing.assert_array_equal(snapshot.map.occupied, grid.occupied)
    np.testing.assert_array_equal(snapshot.beliefs.age, beliefs.age)
