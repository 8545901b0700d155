# pyright: reportMissingImports=false
import json

import numpy as np
import pytest
from dynslam_cli.main import status
from dynslam_cli.studies import random_drives

import dynslam_env


def test_random_drives_through_every_world_find_nothing(capsys):
    assert status(["endure", "--steps", "4000", "--json"]) == 0
    drives = json.loads(capsys.readouterr().out)
    assert [one["world"] for one in drives] == list(dynslam_env.WORLDS)
    for one in drives:
        assert one["found"] == []
        assert one["steps"] == 4000 // len(dynslam_env.WORLDS)
        assert one["episodes"] >= 1
        assert one["slowest_ms"] < 1000


def test_what_is_wrong_is_found():
    env = dynslam_env.DoorWorldEnv()
    observation, _ = env.reset(seed=0)
    assert random_drives._wrong(observation, 0.0, env) == set()
    assert random_drives._wrong(observation, np.nan, env)
    assert random_drives._wrong(observation | {"scan": observation["scan"] - 9}, 0.0, env)
    before = random_drives._places(env)
    env.physics.robot[:2] = 0.8, 5.0  # in a wall's place, beyond another
    assert random_drives._crossed(before, env)
    assert not random_drives._crossed(random_drives._places(env), env)
    assert random_drives._wrong(observation, 0.0, env)


def test_growing_memory_is_found_and_told_by_the_exit_status(monkeypatch, capsys):
    sizes = iter(range(0, 10_000, 100))
    monkeypatch.setattr(random_drives, "resident_mb", lambda: float(next(sizes)))
    assert status(["endure", "--steps", "200"]) == 1
    assert "memory grew" in " ".join(capsys.readouterr().out.split())


def test_a_slow_step_is_found(monkeypatch, capsys):
    monkeypatch.setattr(random_drives, "MAX_STEP_TIME", 1e-9)
    assert status(["endure", "--steps", "200"]) == 1
    assert "a step took" in " ".join(capsys.readouterr().out.split())


def test_too_few_steps_are_refused(capsys):
    assert status(["endure", "--steps", "1"]) == 2
    assert "steps must be a whole number of at least" in capsys.readouterr().err


@pytest.mark.parametrize("beams", [1, 2000])
def test_few_and_many_beams(beams):
    env = dynslam_env.DoorWorldEnv(laser=dynslam_env.Laser(beams=beams))
    observation, _ = env.reset(seed=0)
    for _ in range(20):
        observation = env.step(env.action_space.sample())[0]
        assert observation in env.observation_space


def test_no_doors_and_two_hundred():
    for per_side in (0, 100):
        env = dynslam_env.DoorWorldEnv(
            world=dynslam_env.Corridor(doors_per_side=per_side, length=12.0 + 1.5 * per_side)
        )
        _, info = env.reset(seed=0)
        for _ in range(100):
            info = env.step(env.action_space.sample())[4]
        assert np.isfinite(info["door_angles"]).all()
        assert len(info["door_angles"]) == 2 * per_side
