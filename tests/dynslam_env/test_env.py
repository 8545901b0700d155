import hashlib
import subprocess
import sys
import warnings
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import dynslam_env
from dynslam_env import Corridor, DoorCorridorEnv, Doors, Laser, Robot, Task
from slam import InputError


def digest(seed, steps=120, **parameters):
    """A hash of all that a random drive brings."""
    env = DoorCorridorEnv(**parameters)
    rng, hashed = np.random.default_rng(seed), hashlib.sha256()
    observation, info = env.reset(seed=seed)
    for i in range(steps):
        if i == steps // 2:
            observation, info = env.reset()
        for array in (*observation.values(), info["pose"], info["door_angles"]):
            hashed.update(array.tobytes())
        action = rng.uniform(-1, 1, 2).astype(np.float32)
        observation, reward, _, _, info = env.step(action)
        hashed.update(np.float64(reward).tobytes())
    return hashed.hexdigest()


def test_same_seed_same_bytes():
    assert digest(1) == digest(1)
    assert digest(1) != digest(2)


def test_same_seed_same_bytes_in_another_process():
    code = f"from {__name__} import digest; print(digest(1))"
    run = subprocess.run(
        [sys.executable, "-c", code],
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        check=True,
    )
    assert run.stdout.strip() == digest(1)


def test_a_reset_without_a_seed_is_another_episode():
    env = DoorCorridorEnv()
    first, _ = env.reset(seed=0)
    second, _ = env.reset()
    assert (first["scan"] != second["scan"]).any()


@pytest.mark.parametrize("name", ["DoorCorridor-v0", "dynslam_env:DoorCorridor-v0"])
def test_gymnasium_makes_it(name):
    env = gym.make(name, doors="static", laser=Laser(beams=91))
    observation, _ = env.reset(seed=0)
    assert observation["scan"].shape == (91,)
    assert env.spec is not None
    assert env.spec.max_episode_steps == 1000


@pytest.mark.parametrize("parameters", [{}, {"doors": "static", "laser": Laser(dropout=0.3)}])
def test_gymnasiums_checker_has_no_complaint(parameters, monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")  # it opens a window, too
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(gym.make("DoorCorridor-v0", **parameters).unwrapped)


def test_stable_baselines3s_checker_has_no_complaint():
    checker = pytest.importorskip("stable_baselines3.common.env_checker")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        checker.check_env(DoorCorridorEnv())


def test_observation_and_truth_say_the_same():
    env = DoorCorridorEnv(laser=Laser(dropout=0.1))
    observation, info = env.reset(seed=0)
    for _ in range(30):
        observation, _, _, _, info = env.step(np.array([0.6, 0.02], dtype=np.float32))
        assert observation in env.observation_space
    scan = env.scan
    assert scan.time == info["time"] == pytest.approx(3.0)
    assert observation["scan"][scan.hit] == pytest.approx(scan.ranges[scan.hit])
    assert (observation["scan"][scan.no_echo] == 8.0).all()
    assert (observation["scan"][np.isnan(scan.ranges)] == 0.0).all()
    assert np.isnan(scan.ranges).any()
    assert observation["odometry"] == pytest.approx(np.array(env.motion), abs=1e-6)
    assert info["pose"].tolist() == list(env.pose)
    assert info["collision"] is False
    assert set(info["reward_terms"]) == {"progress", "collision", "time", "arrived"}


def test_the_laser_sees_the_doors_where_physics_has_them():
    env = DoorCorridorEnv(laser=Laser(sigma=0.0))
    env.reset(seed=0)
    moved = set()
    for _ in range(150):
        env.step(np.array([0.3, 0.0], dtype=np.float32))
        ends = env.scan.points @ rotation(env.pose.theta) + (env.pose.x, env.pose.y)
        segments = np.concatenate([env.layout.walls, env.outline()])
        assert distances(ends, segments).max() < 1e-9
        on_a_door = distances(ends, env.outline()) < 1e-9
        moved.add(int(on_a_door.sum()))
    assert len(moved) > 5  # and doors were among what it saw


def rotation(theta):
    c, s = np.cos(theta), np.sin(theta)
    return np.array([[c, s], [-s, c]])


def distances(points, segments):
    a, b = segments[:, :2], segments[:, 2:]
    along = ((points[:, None] - a) * (b - a)).sum(2) / ((b - a) ** 2).sum(1)
    nearest = a + np.clip(along, 0, 1)[..., None] * (b - a)
    return np.hypot(*np.moveaxis(nearest - points[:, None], 2, 0)).min(1)


def test_static_and_moving_doors_share_all_else():
    static, moving = (DoorCorridorEnv(doors=law) for law in ("static", "moving"))
    a, b = static.reset(seed=4), moving.reset(seed=4)
    assert static.layout.walls.tobytes() == moving.layout.walls.tobytes()
    assert a[0]["scan"].tobytes() == b[0]["scan"].tobytes()
    for _ in range(200):
        for env in (static, moving):
            env.step(np.array([0.3, 0.0], dtype=np.float32))
        assert static.pose == moving.pose
        assert static.motion == moving.motion
    assert (static.outline() != moving.outline()).any()


def test_observations_own_their_memory():
    env = DoorCorridorEnv()
    first, info = env.reset(seed=0)
    kept = {key: value.copy() for key, value in (first | {"pose": info["pose"]}).items()}
    for _ in range(5):
        env.step(np.array([1.0, 1.0], dtype=np.float32))
    for key, value in (first | {"pose": info["pose"]}).items():
        assert (value == kept[key]).all()


def test_an_episode_ends_by_arriving_by_crashing_or_by_the_clock():
    near = Corridor(margin=5.9)  # a path of 20 cm, all of it within reach
    env = DoorCorridorEnv(world=near)
    env.reset(seed=0)
    assert env.step(np.zeros(2, dtype=np.float32))[2]
    env = DoorCorridorEnv(task=Task(ends=("crashed",)), robot=Robot(acceleration=9))
    env.reset(seed=0)
    results = [env.step(np.array([-1.0, 0.0], dtype=np.float32)) for _ in range(10)]
    assert results[-1][2]
    assert results[-1][4]["ends"] == {"crashed": True}
    env = gym.make("DoorCorridor-v0", max_episode_steps=3)
    env.reset(seed=0)
    assert [env.step(np.zeros(2, dtype=np.float32))[3] for _ in range(3)] == [False, False, True]


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"doors": "ajar"}, "doors must be one of 'moving', 'static', got 'ajar'"),
        ({"doors": 3}, "doors must be a Doors, got 3"),
        ({"laser": 181}, "laser must be a Laser, got 181"),
        ({"robot": Doors()}, "robot must be a Robot"),
        ({"world": "corridor"}, "world must be a Generator"),
        ({"render_mode": "ascii"}, "render_mode must be one of None, 'human', 'rgb_array'"),
    ],
)
def test_wrong_parameters_are_refused(wrong, message):
    with pytest.raises(InputError, match=message):
        DoorCorridorEnv(**wrong)


@pytest.mark.parametrize("action", [[np.nan, 0.0], [0.0, np.inf]])
def test_an_action_that_is_no_number_is_refused(action):
    env = DoorCorridorEnv()
    env.reset(seed=0)
    with pytest.raises(InputError, match="two finite numbers"):
        env.step(np.array(action, dtype=np.float32))


def test_zero_doors_and_one_beam():
    env = DoorCorridorEnv(world=Corridor(doors_per_side=0), laser=Laser(beams=1))
    observation, info = env.reset(seed=0)
    assert observation["scan"] == pytest.approx([8.0])
    assert info["door_angles"].shape == (0,)
    assert env.outline().shape == (0, 4)
    env.step(np.zeros(2, dtype=np.float32))


def test_the_package_exports_what_it_says():
    assert all(hasattr(dynslam_env, name) for name in dynslam_env.__all__)
