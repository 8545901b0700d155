from typing import Any

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode, SyncVectorEnv

import dynslam_env
from dynslam_env import (
    CarriedAway,
    Corridor,
    Gap,
    Lag,
    Laser,
    MissingBeams,
    OdometryScale,
    Robot,
    Slip,
    Task,
    WheelEncoders,
    WrongBeams,
)
from slam import InputError

QUICK = Robot(acceleration=5.0)
FAULTS = (Slip(at=(0.5, 2.0)), OdometryScale(), Lag(0.3), WrongBeams(), MissingBeams(),
          CarriedAway(distance=0.2, at=1.0), Gap(0.6, at=(1.0, 3.0)), Slip(at=2.0))  # fmt: skip
KINDS = {
    "plain": {},
    "crashing": {"task": Task(ends=("arrived", "crashed")), "robot": QUICK, "doors": "static"},
    "lossy": {"laser": Laser(beams=31, dropout=0.2), "world": Corridor(people=3, length=16.0)},
    "faulty": {"faults": FAULTS, "robot": QUICK},
    "ticking": {"odometry": WheelEncoders(2000.0, wheel_ratio=1.02, sigma=0.02), "robot": QUICK},
}


def pair(mode, limit=None, n=3, **parameters) -> tuple[Any, Any]:
    def single():
        return gym.make("DoorCorridor-v0", max_episode_steps=limit or 1000, **parameters)

    native = gym.make_vec(
        "DoorCorridor-v0", n, max_episode_steps=limit, autoreset_mode=mode, **parameters
    )
    return native, SyncVectorEnv([single] * n, autoreset_mode=mode)


def same(a, b, where=""):
    """Equal to the bit, with equal types, dtypes and keys."""
    assert type(a) is type(b), where
    if isinstance(a, dict):
        assert set(a) == set(b), where
        for key in a:
            same(a[key], b[key], f"{where}/{key}")
    elif isinstance(a, tuple):
        for x, y in zip(a, b, strict=True):
            same(x, y, where)
    elif isinstance(a, np.ndarray):
        assert (a.dtype, a.shape) == (b.dtype, b.shape), where
        if a.dtype == object:
            for x, y in zip(a, b, strict=True):
                same(x, y, where)
        else:
            assert a.tobytes() == b.tobytes(), where
    else:
        assert a == b or (a != a and b != b), where  # both NaN


@pytest.mark.parametrize("kind", KINDS)
def test_attributes_and_calls_are_those_of_single_environments(kind):
    native, sync = pair(AutoresetMode.NEXT_STEP, **KINDS[kind])
    for env in (native, sync):
        env.reset(seed=5)
        for _ in range(5):
            env.step(np.full((3, 2), 0.4, np.float32))
    for name in (
        "pose",
        "velocity",
        "displacement",
        "scan_arrived",
        "scan_late",
        "fault_times",
        "config",
    ):
        for given in (native.get_attr(name), native.call(name)):
            assert type(given) is tuple
            for mine, theirs in zip(given, sync.get_attr(name), strict=True):
                same(mine, theirs, name)
    for mine, theirs in zip(native.call("outline"), sync.call("outline"), strict=True):
        same(mine, theirs)
    for mine, theirs in zip(native.get_attr("scan"), sync.get_attr("scan"), strict=True):
        same(mine.ranges, theirs.ranges)
    walls = [layout.walls for layout in native.get_attr("layout")]
    assert all(map(np.array_equal, walls, [one.walls for one in sync.get_attr("layout")]))
    for mine, theirs in zip(native.call("bound"), sync.call("bound"), strict=True):
        same(mine.covariance, theirs.covariance)


def test_an_unknown_attribute_is_refused():
    native, _ = pair(AutoresetMode.NEXT_STEP)
    with pytest.raises(AttributeError, match="colour"):
        native.get_attr("colour")
    with pytest.raises(gym.error.ResetNeeded):
        native.get_attr("pose")


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
def test_it_is_n_single_environments_bit_for_bit(mode, kind):
    native, sync = pair(mode, 37, **KINDS[kind])
    rng, ends = np.random.default_rng(1), 0
    same(native.reset(seed=5), sync.reset(seed=5))
    for _ in range(150):
        actions = rng.uniform(-1.2, 1.2, (3, 2)).astype(np.float32)
        mine, theirs = native.step(actions), sync.step(actions)
        same(mine, theirs)
        ends += int((mine[2] | mine[3]).sum())
    assert ends >= 9


def test_all_faults_occur_in_a_vector():
    native, _ = pair(AutoresetMode.NEXT_STEP, 60, **KINDS["faulty"])
    _, infos = native.reset(seed=5)
    seen = dict.fromkeys(infos["faults"], 0)
    for _ in range(50):
        infos = native.step(np.full((3, 2), 0.5, dtype=np.float32))[4]
        for name in seen:
            seen[name] |= infos["faults"][name]
    active = {name: np.array(rows).all() for name, rows in seen.items() if name[0] != "_"}
    assert len(active) == len(FAULTS)
    assert all(active.values()), active


def test_both_ends_are_met_and_given_back():
    native, _ = pair(AutoresetMode.SAME_STEP, 60, **KINDS["crashing"])
    native.reset(seed=0)
    seen = set()
    for _ in range(150):
        _, _, terminated, truncated, infos = native.step(np.full((3, 2), -1.0, dtype=np.float32))
        for i in np.flatnonzero(terminated | truncated):
            seen.add(bool(terminated[i]))
            assert infos["_final_obs"][i]
            assert infos["final_obs"][i] in native.single_observation_space
            assert infos["final_info"]["time"][i] > 0.0
            assert infos["time"][i] == 0.0
    assert True in seen


def test_reset_by_mask_and_without_autoreset():
    native, sync = pair(AutoresetMode.DISABLED, 5)
    for env in (native, sync):
        env.reset(seed=[3, None, 7])
    same(native.np_random_seed[0], 3)
    native, sync = pair(AutoresetMode.DISABLED, 5)
    same(native.reset(seed=3), sync.reset(seed=3))
    actions = np.zeros((3, 2), dtype=np.float32)
    for _ in range(5):
        same(native.step(actions), sync.step(actions))
    with pytest.raises(gym.error.ResetNeeded, match=r"worlds \[0, 1, 2\] are over"):
        native.step(actions)
    mask = np.array([True, False, True])
    mine, theirs = (e.reset(seed=8, options={"reset_mask": mask.copy()}) for e in (native, sync))
    same(mine, theirs)
    with pytest.raises(gym.error.ResetNeeded, match=r"worlds \[1\]"):
        native.step(actions)


def test_what_is_given_back_owns_its_memory():
    native, _ = pair(AutoresetMode.NEXT_STEP)
    observation, info = native.reset(seed=0)
    kept = [a.copy() for a in (*observation.values(), info["pose"], info["door_angles"])]
    for _ in range(5):
        native.step(np.ones((3, 2), dtype=np.float32))
    for a, b in zip((*observation.values(), info["pose"], info["door_angles"]), kept, strict=True):
        assert (a == b).all()


def test_observations_are_in_their_space():
    native, _ = pair(AutoresetMode.NEXT_STEP)
    observation, _ = native.reset(seed=0)
    assert observation in native.observation_space
    for _ in range(20):
        observation = native.step(native.action_space.sample())[0]
        assert observation in native.observation_space


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"num_envs": 0}, "num_envs must be a whole number of at least 1"),
        ({"autoreset_mode": "Later"}, "autoreset_mode must be one of 'NextStep', 'SameStep'"),
        ({"max_episode_steps": 0}, "max_episode_steps must be a whole number of at least 1"),
        ({"render_mode": "human"}, "render_mode must be one of None, 'rgb_array'"),
        ({"laser": 3}, "laser must be a Laser"),
    ],
)
def test_wrong_parameters_are_refused(wrong, message):
    with pytest.raises(InputError, match=message):
        dynslam_env.DoorWorldVectorEnv(**wrong)


def test_wrong_calls_are_refused():
    native, _ = pair(AutoresetMode.NEXT_STEP)
    with pytest.raises(gym.error.ResetNeeded):
        native.step(np.zeros((3, 2), dtype=np.float32))
    with pytest.raises(InputError, match="seed must be one number or 3"):
        native.reset(seed=[1, 2])
    for mask in (np.ones(2, dtype=bool), [True] * 3, np.zeros(3, dtype=bool)):
        with pytest.raises(InputError, match="reset_mask"):
            native.reset(options={"reset_mask": mask})
    native.reset(seed=0)
    with pytest.raises(InputError, match=r"of shape \(3, 2\), got float32 of shape \(2, 2\)"):
        native.step(np.zeros((2, 2), dtype=np.float32))
    with pytest.raises(InputError, match="finite numbers from -1 to 1"):
        native.step(np.array([[0, 0], [0, np.nan], [0, 0]], dtype=np.float32))


def test_a_first_reset_of_some_worlds_only():
    native, _ = pair(AutoresetMode.DISABLED)
    alone = gym.make("DoorCorridor-v0")
    mask = np.array([False, True, False])
    mine, theirs = native.reset(seed=8, options={"reset_mask": mask}), alone.reset(seed=9)
    assert mine[1]["_pose"].tolist() == mask.tolist()
    same({key: rows[1] for key, rows in mine[0].items()}, theirs[0])
    same(mine[1]["door_angles"][1], theirs[1]["door_angles"])
    with pytest.raises(gym.error.ResetNeeded):
        native.step(np.zeros((3, 2), dtype=np.float32))


class Sometimes:
    """A world with more doors each time."""

    def __init__(self):
        self.drawn = 0

    def layout(self, rng):
        self.drawn += 1
        return Corridor(doors_per_side=self.drawn).layout(rng)


def test_worlds_with_unequal_numbers_of_doors_have_rows_that_end_in_nan():
    env: Any = gym.make_vec("DoorCorridor-v0", 2, world=Sometimes())
    env.reset(seed=0)
    *_, infos = env.step(np.zeros((2, 2)))
    angles = infos["door_angles"]
    assert angles.shape == (2, 4)
    assert np.isnan(angles).tolist() == [[False, False, True, True], [False] * 4]
    assert [len(world.openings) for world in env.unwrapped.physics] == [2, 4]
    alone = gym.make_vec("DoorCorridor-v0", 1, world=Sometimes())
    for doors in (2, 4):
        assert alone.reset(seed=0)[1]["door_angles"].shape == (1, doors)


@pytest.mark.parametrize("faults", [(), FAULTS])
@pytest.mark.parametrize("id", dynslam_env.WORLDS)
def test_threads_change_nothing(id, faults):
    one, two = (gym.make_vec(id, 5, threads=n, max_episode_steps=20, faults=faults) for n in (1, 3))
    same(one.reset(seed=1), two.reset(seed=1))
    rng = np.random.default_rng(0)
    for _ in range(50):
        actions = rng.uniform(-1, 1, (5, 2)).astype(np.float32)
        same(one.step(actions), two.step(actions))


def test_refused_actions_leave_everything_as_it_was():
    native, sync = pair(AutoresetMode.NEXT_STEP, 3, n=2, doors="static")
    for env in (native, sync):
        env.reset(seed=0)
        env.reset(seed=5, options={"reset_mask": np.array([True, False])})
    actions = np.zeros((2, 2), dtype=np.float32)
    for _ in range(3):
        same(native.step(actions), sync.step(actions))
    native.reset(options={"reset_mask": np.array([False, True])}, seed=3)  # the other one is over
    sync.reset(options={"reset_mask": np.array([False, True])}, seed=3)
    with pytest.raises(InputError, match="finite"):
        native.step(np.array([[0.0, 0.0], [np.nan, 0.0]], dtype=np.float32))
    same(native.step(actions), sync.step(actions))


def test_a_refused_start_asks_for_another_reset():
    env: Any = gym.make_vec("DoorCorridor-v0", 2)
    env.reset(seed=0)
    with pytest.raises(InputError, match="cannot begin"):
        env.reset(options={"start": (0.0, 0.0, 0.0)})
    with pytest.raises(gym.error.ResetNeeded):
        env.step(np.zeros((2, 2)))
    env.reset(seed=0)
    env.step(np.zeros((2, 2)))


def test_what_goes_wrong_in_a_thread_is_told():
    env: Any = gym.make_vec("DoorCorridor-v0", 3, threads=2)
    env.reset(seed=0)
    env.physics[1].mechanics.in_space()  # a step in Python
    env.physics[1].finish_step = lambda remains: 1 / 0
    with pytest.raises(ZeroDivisionError):
        env.step(np.zeros((3, 2), dtype=np.float32))


def test_it_draws_all_worlds():
    env: Any = gym.make_vec("DoorCorridor-v0", 2, render_mode="rgb_array")
    env.reset(seed=0)
    frames = env.render()
    assert len(frames) == 2
    assert frames[0].shape == frames[1].shape
    assert (frames[0] != frames[1]).any()
