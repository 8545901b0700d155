import math
from dataclasses import replace

import numpy as np
import pytest

import dynslam_env
from dynslam_env import DoorWorldEnv, Laser, Layout, Recorder
from dynslam_env.simulation.pose_bounds import position_bounds
from slam import InputError, Pose2
from slam.io.episode_file import load_episode, save_episode

ROOM = [(0, 0, 6, 0), (6, 0, 7, 4), (7, 4, 1, 5), (1, 5, 0, 0)]
MOUNT = Pose2(0.15, -0.05, 0.3)


def env_in(walls, start, **laser):
    env = DoorWorldEnv(
        world=Layout(np.array(walls), (), start, np.array([(3.0, 2.0)])), laser=Laser(**laser)
    )
    env.reset(seed=0)
    return env


@pytest.mark.parametrize("start", [Pose2(2.0, 2.0, 0.3), Pose2(4.5, 3.0, -2.0), Pose2(1.0, 1, 2.9)])
@pytest.mark.parametrize("mount", [Pose2(), MOUNT])
def test_the_bound_of_the_pose_is_that_of_finite_differences(start, mount):
    env = env_in(ROOM, start, beams=90, field_of_view=4.0, sigma=0.02, mount=mount)
    scanner, segments = env._batch.scanners[0], env.physics.segments
    gradient, step = np.empty((90, 3)), 1e-6
    for k in range(3):
        ranges = []
        for sign in (1, -1):
            moved = np.array(start)
            moved[k] += sign * step
            ranges.append(scanner.exact(Pose2(*moved), segments))
        gradient[:, k] = (ranges[0] - ranges[1]) / (2 * step)
    expected = np.linalg.inv(gradient.T @ gradient / 0.02**2)
    assert env.bound().covariance == pytest.approx(expected, rel=1e-4, abs=1e-12)
    assert env.bound().std_x == pytest.approx(math.sqrt(expected[0, 0]), rel=1e-4)


def test_open_doors_tell_where_along_the_passage_the_robot_is():
    def median_bound(share):
        stds = []
        for seed in range(12):
            env = DoorWorldEnv(doors=dynslam_env.Doors(dynslam_env.Fixed(), open_share=share))
            env.reset(seed=seed, options={"start": (4.0 + seed / 3, 0.0, 0.0)})
            stds.append(env.bound().std_x)
        return np.median(stds)

    assert median_bound(1.0) < 0.75 * median_bound(0.0) < 0.004


def test_along_an_endless_passage_there_is_no_bound():
    env = env_in([(-50, 1, 50, 1), (-50, -1, 50, -1)], Pose2())
    assert env.bound().std_x == math.inf
    assert env.bound().std_y < 0.01


def test_a_laser_without_noise_has_none():
    with pytest.raises(InputError, match="sigma must be a finite number above 0"):
        env_in(ROOM, Pose2(2, 2, 0), sigma=0.0).bound()


def test_nothing_in_reach_says_nothing():
    bound = env_in([(100, 0, 101, 0)], Pose2()).bound()
    assert bound.std_x == bound.std_y == bound.std_theta == math.inf


def test_a_beam_without_a_reading_says_nothing():
    def std(dropout):
        env = DoorWorldEnv(laser=Laser(dropout=dropout))
        env.reset(seed=0)
        return env.bound().std_x

    assert std(0.0) < std(0.5) < std(1.0) == math.inf


def test_without_walls_and_doors_nothing_is_known():
    assert env_in(np.zeros((0, 4)), Pose2()).bound().std_x == math.inf


class TestAnEpisode:
    LASER = Laser(beams=60, field_of_view=3.0, sigma=0.02, dropout=0.1, mount=MOUNT)

    def recorded(self):
        env = DoorWorldEnv(laser=self.LASER, doors=dynslam_env.Uniform(0.5, 2.0))
        env.reset(seed=2)
        recorder, stds = Recorder(env), [env.bound()]
        for _ in range(30):
            env.step(np.array([0.6, 0.03], dtype=np.float32))
            recorder.step()
            stds.append(env.bound())
        return recorder.episode({"config": env.config}), stds

    def test_is_bounded_scan_by_scan_as_the_environment_is(self):
        episode, stds = self.recorded()
        expected = [math.hypot(one.std_x, one.std_y) for one in stds]
        assert position_bounds(episode) == pytest.approx(expected, rel=1e-9)
        assert len(set(expected)) == len(expected)

    def test_is_the_same_when_it_was_saved_and_read(self, tmp_path):
        episode, _ = self.recorded()
        save_episode(episode, tmp_path / "drive.npz")
        again = position_bounds(load_episode(tmp_path / "drive.npz"))
        assert again.tolist() == position_bounds(episode).tolist()

    @pytest.mark.parametrize(
        ("parts", "message"),
        [
            ({"truth": None}, "one with the truth"),
            ({"meta": {}}, r"meta\['config'\]\['laser'\]\['sigma'\]"),
            ({"meta": {"config": {"laser": {"sigma": 0.0}}}}, "sigma must be a finite number"),
        ],
    )
    def test_without_truth_or_noise_has_none(self, parts, message):
        episode, _ = self.recorded()
        with pytest.raises(InputError, match=message):
            position_bounds(replace(episode, **parts))

    def test_of_two_lasers_is_refused(self):
        episode, _ = self.recorded()
        odd = replace(episode.scans[3], angles=episode.scans[3].angles + 0.01)
        scans = (*episode.scans[:3], odd, *episode.scans[4:])
        with pytest.raises(InputError, match="scans of one laser"):
            position_bounds(replace(episode, scans=scans))
