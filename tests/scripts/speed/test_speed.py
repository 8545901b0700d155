# pyright: reportMissingImports=false
import json
from dataclasses import replace
from pathlib import Path

import pytest
from dynslam_cli.main import status
from dynslam_cli.speed import environment as speed_env
from dynslam_cli.speed import long as speed_long
from dynslam_cli.speed import measurements
from dynslam_cli.speed import patrol as speed_patrol

import slam

TINY = {
    "n_envs": 2, "policy": "MultiInputPolicy", "n_steps": 4, "batch_size": 8, "n_epochs": 1,
    "policy_kwargs": "dict(net_arch=[8], features_extractor_kwargs=dict(cnn_output_dim=8))",
}  # fmt: skip


@pytest.fixture
def small(monkeypatch):
    monkeypatch.setattr(speed_env, "STEPS_PER_ROUND", 20)
    monkeypatch.setattr(speed_env, "SLAM_STEPS_PER_ROUND", 5)
    monkeypatch.setattr(speed_env, "BEAMS", (31,))
    monkeypatch.setattr(speed_env, "DOORS", (0, 2))
    monkeypatch.setattr(speed_env, "EXTRA_WALLS", (10,))
    monkeypatch.setattr(speed_env, "RESETS", ("DoorCorridor-v0", "DoorPatrol-v1"))
    monkeypatch.setattr(speed_patrol, "WORLDS", 2)
    monkeypatch.setattr(speed_patrol, "STEPS_PER_ROUND", 2)
    monkeypatch.setattr(measurements, "BUILDING_SIDE", 20.0)
    monkeypatch.setattr(measurements, "SCANS", 20)
    monkeypatch.setattr(speed_long, "WARM_UP_SCANS", 3)


@pytest.fixture
def short(monkeypatch, short_episode):
    episode = replace(short_episode, scans=short_episode.scans[:20])
    monkeypatch.setattr(measurements, "record_corridor", lambda seed, doors: episode)


def printed_rows(capsys, *arguments: str) -> list[dict]:
    assert status(["speed", "--json", *arguments]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert "pymunk" in printed["versions"]
    return printed["rows"]


def test_it_measures_every_case_beside_its_floor(small, capsys):
    rows = printed_rows(capsys, "--what", "env", "--rounds", "2", "--num-envs", "3")
    by_name = {row["what"]: row for row in rows}
    assert list(by_name) == [
        "one environment, gym.make",
        "one of 3, gym.make_vec",
        "one of 3, gym.make_vec, 2 threads",
        "31 beams",
        "0 doors",
        "2 doors",
        "10 more walls",
        "SlamWrapper, map_crop=4 (floor: none)",
        "reset of DoorCorridor-v0",
        "reset of DoorPatrol-v1",
    ]
    for what, row in by_name.items():
        assert row["table"] == "env"
        assert row["step_us"] > 0
        assert row["steps_per_s"] == pytest.approx(1e6 / row["step_us"])
        assert what.startswith("reset") or row["floor_us"] > 0


def test_it_measures_every_plain_variant(short, capsys):
    rows = printed_rows(capsys, "--what", "slam,memory", "--rounds", "1")
    assert [row["what"] for row in rows if row["table"] == "slam"] == [
        name for name in slam.variants() if "/" not in name
    ]
    growing = [row for row in rows if row["table"] == "memory"]
    assert {"static-ml", "dynamic-ml"} <= {row["what"] for row in growing}
    assert all(len(row["bytes"]) == 4 for row in growing)


def test_of_the_variants_only_the_chosen_and_of_a_log_as_of_the_corridor(short, log: Path, capsys):
    chosen = ["--variants", "dynamic-ml, odometry", "--log", str(log), "--rounds", "1"]
    rows = printed_rows(capsys, "--what", "slam", *chosen)
    assert [(row["on"], row["what"]) for row in rows] == [
        ("corridor", "dynamic-ml"),
        ("corridor", "odometry"),
        ("drive.log", "dynamic-ml"),
        ("drive.log", "odometry"),
    ]


def test_it_prints_tables(small, short, monkeypatch, capsys):
    pytest.importorskip("stable_baselines3")
    settings = "agents.training.settings.read_settings"
    monkeypatch.setattr(settings, lambda algorithm, env: TINY)
    assert status(["speed", "--what", "all", "--variants", "static-ml", "--rounds", "1"]) == 0
    printed = capsys.readouterr().out
    for part in (
        "step / floor",
        "gym.make_vec",
        "CPU ms",
        "4/4 over 1/4",
        "with layers",
        "learning by PPO, 2 processes",
        "DoorLoop-v0, 20 scans",
    ):
        assert part in printed
    assert "20 x 20 m" in printed


@pytest.mark.parametrize("wrong", ["--rounds", "--num-envs"])
def test_wrong_numbers_are_refused(wrong, capsys):
    assert status(["speed", wrong, "0"]) == 2
    assert f"{wrong[2:]} must be a whole number of at least 1" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ["--what", "env,nothing"],
            "unknown measurement 'nothing'; known: all, env, slam, memory, patrol",
        ),
        (["--what", " , "], "no measurement named; known: all, env"),
        (["--variants", "static-ml,x,y"], "unknown SLAM variant 'x'; known: all, plain, odometry"),
        (["--what", "env", "--log", "some.log"], "a log is for --what slam, got --what env"),
        (["--what", "slam", "--log", "none.log"], "none.log: no such file"),
    ],
)
def test_what_is_not_known_is_refused(arguments, message, capsys):
    assert status(["speed", *arguments]) == 2
    assert message in capsys.readouterr().err
