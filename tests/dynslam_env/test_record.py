import json

import gymnasium as gym
import numpy as np
import pytest

from dynslam_env import CarriedAway, DoorWorldEnv, Gap, Lag, SlamWrapper, Slip, record
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


FAULTS = (Slip(at=0.5), Gap(1.0, at=1.0), CarriedAway(distance=0.05, at=2.5), Slip(at=60.0))


def test_an_episode_with_faults_is_what_the_environment_said():
    """No scan in the gap; the displacement after it is the sum; poses are the truth."""
    made = record(make(faults=FAULTS), Ahead(), seed=3)
    env = DoorWorldEnv(faults=FAULTS)
    env.reset(seed=3)
    moved, motions, k = Pose2(), made.displacements(), 0
    for step in range(31):
        if env.scan_arrived:
            assert truth_of(made).poses[k].tolist() == list(env.pose)
            assert (made.scans[k].ranges == env.scan.ranges).all()
            assert made.times[k] == pytest.approx(step / 10)
            assert np.array(motions[k]) == pytest.approx(np.array(moved), abs=1e-9)
            moved, k = Pose2(), k + 1
        env.step(np.array([0.5, 0.0], dtype=np.float32))
        moved = moved @ env.displacement
    assert k == len(made.scans) == 21
    assert np.diff(made.times).max() == pytest.approx(1.1)
    assert len(made.odometry.times) == 31


def test_an_episode_keeps_the_times_of_its_faults(tmp_path):
    made = record(make(faults=FAULTS), Ahead(), seed=3)
    save_episode(made, tmp_path / "episode.npz")
    loaded = load_episode(tmp_path / "episode.npz")
    assert loaded.meta["faults"] == {"Slip": 0.5, "Gap": 1.0, "CarriedAway": 2.5}
    assert [fault["type"] for fault in loaded.meta["config"]["faults"]] == [
        type(fault).__name__ for fault in FAULTS
    ]
    assert loaded.displacements() == made.displacements()
    assert "faults" not in record(make(), Ahead(), seed=3).meta


def test_late_scans_are_recorded_late(episode):
    late = record(make(faults=[Lag(0.3)]), Ahead(), seed=3)
    assert late.displacements() == episode.displacements()
    assert (truth_of(late).poses[1:4] == episode.truth.poses[1]).all()
    for k in range(4, 31):
        assert (truth_of(late).poses[k] == episode.truth.poses[k - 3]).all()
        assert (late.scans[k].ranges == episode.scans[k - 3].ranges).all()
        assert late.scans[k].time == episode.scans[k].time
