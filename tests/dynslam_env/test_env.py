import hashlib
import subprocess
import sys
import warnings
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec
from gymnasium.utils.env_checker import check_env

import dynslam_env
from dynslam_env import Corridor, Doors, DoorWorldEnv, Fixed, Laser, Robot, Task
from slam import InputError


def digest(seed, name="DoorCorridor-v0", steps=120):
    """A hash of all that a random drive brings."""
    env = gym.make(name)
    rng, hashed = np.random.default_rng(seed), hashlib.sha256()
    observation, info = env.reset(seed=seed)
    for i in range(steps):
        if i == steps // 2:
            observation, info = env.reset()
        for array in (*observation.values(), info["pose"], info["door_angles"], info["people"]):
            hashed.update(array.tobytes())
        action = rng.uniform(-1, 1, 2).astype(np.float32)
        observation, reward, _, _, info = env.step(action)
        hashed.update(np.float64(reward).tobytes())
    return hashed.hexdigest()


@pytest.mark.parametrize("name", dynslam_env.WORLDS)
def test_same_seed_same_bytes(name):
    assert digest(1, name) == digest(1, name)
    assert digest(1, name) != digest(2, name)


def test_same_seed_same_bytes_in_another_process():
    names = list(dynslam_env.WORLDS)
    code = f"from {__name__} import digest; print(*(digest(1, name) for name in {names}))"
    run = subprocess.run(
        [sys.executable, "-c", code],
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        check=True,
    )
    there = dict(zip(names, run.stdout.split(), strict=True))
    assert there == {name: digest(1, name) for name in names}


def test_a_reset_without_a_seed_is_another_episode():
    env = DoorWorldEnv()
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


@pytest.mark.parametrize("name", dynslam_env.WORLDS)
def test_gymnasiums_checker_has_no_complaint(name, monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")  # it opens a window, too
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(gym.make(name).unwrapped)
        check_env(gym.make(name, laser=Laser(dropout=0.3), doors="static").unwrapped)


def test_stable_baselines3s_checker_has_no_complaint():
    checker = pytest.importorskip("stable_baselines3.common.env_checker")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        checker.check_env(DoorWorldEnv())


def test_observation_and_truth_say_the_same():
    env = DoorWorldEnv(laser=Laser(dropout=0.1))
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
    assert observation["odometry"] == pytest.approx(np.array(env.displacement), abs=1e-6)
    assert info["pose"].tolist() == list(env.pose)
    assert info["collision"] is False
    assert set(info["reward_terms"]) == {"progress", "collision", "time", "arrived"}


def test_a_scan_is_one_object_until_there_is_another():
    env = DoorWorldEnv()
    env.reset(seed=0)
    first = env.scan
    assert env.scan is first
    env.step(np.zeros(2, dtype=np.float32))
    second = env.scan
    assert second is env.scan
    assert second is not first
    assert second.time > first.time
    env.reset(seed=1)
    assert env.scan.time == first.time
    assert not np.array_equal(env.scan.ranges, first.ranges)


def test_the_laser_sees_the_doors_where_physics_has_them():
    env = DoorWorldEnv(laser=Laser(sigma=0.0))
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
    static, moving = (DoorWorldEnv(doors=law) for law in ("static", "moving"))
    a, b = static.reset(seed=4), moving.reset(seed=4)
    assert static.layout.walls.tobytes() == moving.layout.walls.tobytes()
    assert a[0]["scan"].tobytes() == b[0]["scan"].tobytes()
    for _ in range(200):
        for env in (static, moving):
            env.step(np.array([0.3, 0.0], dtype=np.float32))
        assert static.pose == moving.pose
        assert static.displacement == moving.displacement
    assert (static.outline() != moving.outline()).any()


def test_observations_own_their_memory():
    env = DoorWorldEnv()
    first, info = env.reset(seed=0)
    kept = {key: value.copy() for key, value in (first | {"pose": info["pose"]}).items()}
    for _ in range(5):
        env.step(np.array([1.0, 1.0], dtype=np.float32))
    for key, value in (first | {"pose": info["pose"]}).items():
        assert (value == kept[key]).all()


def test_an_episode_ends_by_arriving_by_crashing_or_by_the_clock():
    near = Corridor(margin=5.9)  # a path of 20 cm, all of it within reach
    env = DoorWorldEnv(world=near)
    env.reset(seed=0)
    assert env.step(np.zeros(2, dtype=np.float32))[2]
    env = DoorWorldEnv(task=Task(ends=("crashed",)), robot=Robot(acceleration=9))
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
        ({"doors": 3}, "doors must be .* a law such as .*, or a Doors, got 3"),
        ({"laser": 181}, "laser must be a Laser, or one of SICK-LMS200, .*, got 181"),
        ({"robot": Doors()}, "robot must be a Robot"),
        ({"world": "castle"}, "world must be one of 'corridor', 'loop', 'office', 'crowd'"),
        ({"world": Corridor}, "world must be .* a Corridor, Loop, Office, Wings or Layout"),
        ({"doors": Doors(law=Fixed()), "people": 3}, "people must be a People, got 3"),
        ({"render_mode": "ascii"}, "render_mode must be one of None, 'human', 'rgb_array'"),
    ],
)
def test_wrong_parameters_are_refused(wrong, message):
    with pytest.raises(InputError, match=message):
        DoorWorldEnv(**wrong)


@pytest.mark.parametrize("action", [[np.nan, 0.0], [0.0, np.inf]])
def test_an_action_that_is_no_number_is_refused(action):
    env = DoorWorldEnv()
    env.reset(seed=0)
    with pytest.raises(InputError, match="two finite numbers"):
        env.step(np.array(action, dtype=np.float32))


def test_zero_doors_and_one_beam():
    env = DoorWorldEnv(world=Corridor(doors_per_side=0), laser=Laser(beams=1))
    observation, info = env.reset(seed=0)
    assert observation["scan"] == pytest.approx([8.0])
    assert info["door_angles"].shape == (0,)
    assert env.outline().shape == (0, 4)
    env.step(np.zeros(2, dtype=np.float32))


def test_the_package_exports_what_it_says():
    assert all(hasattr(dynslam_env, name) for name in dynslam_env.__all__)


@pytest.mark.parametrize("kind", ["float16", "float32", "float64", "int8", "int64"])
def test_actions_of_any_kind_of_number(kind):
    env, other = DoorWorldEnv(), DoorWorldEnv()
    env.reset(seed=0)
    other.reset(seed=0)
    action: Any = np.array([1, 0], dtype=kind)
    expected = other.step(action.astype(np.float32))[4]["pose"]
    assert env.step(action)[4]["pose"].tolist() == expected.tolist()


@pytest.mark.parametrize(
    "action", [None, "ahead", [True, False], [1j, 0], [1.0], [1.0, 2.0, 3.0], [[1.0, 0.0]]]
)
def test_what_is_no_action_is_refused(action):
    env: Any = DoorWorldEnv()
    env.reset(seed=0)
    with pytest.raises(InputError, match=r"actions are numbers from -1 to 1 in an array of shape"):
        env.step(action)


@pytest.mark.parametrize("name", ["pose", "displacement", "scan", "layout", "physics"])
def test_before_a_reset_there_is_nothing(name):
    with pytest.raises(gym.error.ResetNeeded):
        getattr(DoorWorldEnv(), name)


@pytest.mark.parametrize("name", ["outline", "occupancy", "bound", "scene"])
def test_before_a_reset_nothing_can_be_asked(name):
    with pytest.raises(gym.error.ResetNeeded):
        getattr(DoorWorldEnv(), name)()


@pytest.mark.parametrize("name", dynslam_env.WORLDS)
def test_the_specification_survives_json(name):
    made: Any = gym.make(name).spec
    spec = EnvSpec.from_json(made.to_json())
    one, two = gym.make(spec), gym.make(name)
    assert one.reset(seed=0)[0]["scan"].tobytes() == two.reset(seed=0)[0]["scan"].tobytes()


def test_the_robot_does_not_begin_on_a_person_or_outside():
    env = gym.make("DoorCrowd-v0")
    _, info = env.reset(seed=0)
    x, y = info["people"][0]
    with pytest.raises(InputError, match="person 0 begins 0 m from there"):
        env.reset(seed=0, options={"start": (x, y, 0.0)})
    with pytest.raises(InputError, match="outside of the world"):
        env.reset(seed=0, options={"start": (50.0, 50.0, 0.0)})


def test_people_who_do_not_fit_are_refused():
    env = gym.make("DoorCrowd-v0", people=dynslam_env.People(radius=0.5))
    with pytest.raises(InputError, match=r"person 0 of radius 0.5 m does not fit"):
        env.reset(seed=0)


def test_leaves_that_would_fly_are_refused():
    env = DoorWorldEnv(doors=Doors(swing_time=0.1))
    with pytest.raises(InputError, match=r"cannot open in Doors.swing_time = 0.1 s"):
        env.reset(seed=0)


def test_a_generator_that_draws_no_layout_is_refused():
    class Nothing:
        def layout(self, rng):
            return [(0, 0, 1, 0)]

    env = DoorWorldEnv(world=Nothing())  # type: ignore[arg-type]
    with pytest.raises(InputError, match="gives must be a Layout"):
        env.reset(seed=0)


def test_a_law_will_do_for_doors():
    law = dynslam_env.Periodic(3.0)
    assert DoorWorldEnv(doors=law).world_config == DoorWorldEnv(doors=Doors(law=law)).world_config
