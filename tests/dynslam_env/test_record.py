import json

import gymnasium as gym
import numpy as np
import pytest

from dynslam_env import DoorWorldEnv, SlamWrapper, record
from slam import InputError, Pose2
from slam.io.episode_file import load_episode, save_episode


class Ahead:
    """Drives straight on; remembers how it was asked."""

    def __init__(self):
        self.calls = []

    def predict(self, observation, state=None, episode_start=None, deterministic=False):
        self.calls.append((state, bool(np.all(episode_start)), deterministic))
        return np.array([0.5, 0.0], dtype=np.float32), (state or 0) + 1


def truth_of(episode):
    assert episode.truth is not None
    return episode.truth


def make(**parameters):
    return gym.make("DoorCorridor-v0", max_episode_steps=30, **parameters)


@pytest.fixture(scope="module")
def episode():
    return record(make(), Ahead(), seed=3)


def test_an_episode_has_a_scan_a_pose_and_doors_for_every_step(episode):
    assert len(episode.scans) == 31
    assert episode.times == pytest.approx(np.arange(31) / 10)
    assert episode.truth.poses.shape == (31, 3)
    assert episode.truth.doors.shape == (31, 32, 4)


def test_the_truth_is_the_environments(episode):
    env = DoorWorldEnv()
    env.reset(seed=3)
    for i in range(31):
        assert episode.truth.poses[i].tolist() == list(env.pose)
        assert (episode.truth.doors[i] == env.outline()).all()
        assert (episode.scans[i].ranges == env.scan.ranges).all()
        env.step(np.array([0.5, 0.0], dtype=np.float32))
    assert (episode.truth.walls == env.layout.walls).all()


def test_the_odometry_is_what_the_wheels_said(episode):
    env, motions = DoorWorldEnv(), episode.displacements()
    env.reset(seed=3)
    assert motions[0] == Pose2()
    for motion in motions[1:]:
        env.step(np.array([0.5, 0.0], dtype=np.float32))
        assert np.array(motion) == pytest.approx(np.array(env.displacement), abs=1e-9)


def test_the_driver_is_asked_as_stable_baselines3_asks():
    driver = Ahead()
    record(make(), driver, seed=0)
    assert driver.calls[:2] == [(None, True, True), (1, False, True)]
    assert len(driver.calls) == 30


def test_wrapped_environments_record_the_same(episode):
    wrapped = record(SlamWrapper(make(), "odometry"), Ahead(), seed=3)
    assert (truth_of(wrapped).poses == episode.truth.poses).all()
    assert all(
        (a.ranges == b.ranges).all() for a, b in zip(wrapped.scans, episode.scans, strict=True)
    )


def test_an_episode_is_saved_with_its_configuration(episode, tmp_path):
    save_episode(episode, tmp_path / "episode.npz")
    loaded = load_episode(tmp_path / "episode.npz")
    assert loaded.meta == json.loads(json.dumps(episode.meta))
    assert loaded.meta["seed"] == 3
    law = {"type": "Uniform", "shortest": 5.0, "longest": 20.0}
    assert loaded.meta["config"]["doors"]["law"] == law
    assert loaded.meta["config"]["laser"]["beams"] == 181


def test_another_environment_is_refused():
    with pytest.raises(InputError, match="must be a DoorWorldEnv"):
        record(gym.make("CartPole-v1"), Ahead())
