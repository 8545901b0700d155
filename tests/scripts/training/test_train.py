# pyright: reportMissingImports=false
import json
from pathlib import Path

import gymnasium as gym
import pytest

pytest.importorskip("stable_baselines3")

from dynslam_cli import main
from dynslam_cli.training.patrol_jobs import Patrol
from dynslam_cli.training.worlds import worlds_option
from rich.progress import Progress

TINY = """
DoorPatrol-v0:
  n_envs: 2
  n_timesteps: 32
  policy: MultiInputPolicy
  n_steps: 16
  batch_size: 16
  n_epochs: 1
  policy_kwargs: "dict(net_arch=dict(pi=[8], vf=[8]))"
"""


STEPS = 20  # of an episode


@pytest.fixture
def tiny(tmp_path, monkeypatch):
    """Runs `dynslam train` on next to nothing."""
    monkeypatch.setattr(gym.spec("DoorPatrol-v0"), "max_episode_steps", STEPS)
    path = tmp_path / "tiny.yml"
    path.write_text(TINY)

    def run(*arguments: str, out: Path = tmp_path / "out") -> int:
        given = ["--slam", "odometry", "--workers", "1", "--hyperparameters", str(path)]
        return main.status(["train", *given, *arguments, "--out", str(out)])

    return run


def lines(out: Path) -> list[dict]:
    return [json.loads(line) for line in (out / "progress.jsonl").read_text().splitlines()]


def test_a_training_writes_its_files_and_goes_on(tiny, tmp_path, capsys):
    out = tmp_path / "out"
    assert tiny() == 0
    assert "best.zip lookout --worlds corridor --split test" in capsys.readouterr().out
    assert [row["steps"] for row in lines(out)] == [0, 32]
    for name in ("best.zip", "checkpoint.zip", "config.json"):
        assert (out / name).stat().st_size > 100
    assert list(out.glob("tensorboard*/events*"))
    assert tiny() == 2
    assert "continue it by --resume, or choose another --out" in capsys.readouterr().err
    assert tiny("--resume", "--seed", "3") == 2
    assert "seed is 0 there, not 3" in capsys.readouterr().err
    assert tiny("--resume", "--steps", "64") == 0
    assert [row["steps"] for row in lines(out)] == [0, 32, 64]
    row = Patrol("corridor", "odometry", str(out / "best.zip"), 7000, 3)().row
    assert row["error"] is None


def test_the_steps_are_told_from_the_first_on(tiny, monkeypatch):
    told = []
    update = Progress.update

    def noted(bar, task, **changes):
        told.append(changes.get("completed"))
        update(bar, task, **changes)

    monkeypatch.setattr(Progress, "update", noted)
    assert tiny() == 0
    first, *steps, last = told  # of the two evaluations
    assert (first, last) == (0, 32)
    assert steps == list(range(2, 33, 2))
    told.clear()
    assert tiny("--resume", "--steps", "64") == 0
    assert told[0] == 34


def test_a_training_may_give_the_slam_one_scan_a_decision(tiny, tmp_path):
    assert tiny("--scan-every", "4") == 0
    config = json.loads((tmp_path / "out" / "config.json").read_text())
    assert config["parameters"] == {"world": "corridor", "slam": "odometry", "scan_every": 4}


def test_a_patrol_of_another_package_is_trained_on(tiny, tmp_path, own_ids, capsys):
    path = tmp_path / "own.yml"
    path.write_text(TINY.replace("DoorPatrol-v0", "OwnPatrol-v0"))
    given = ["--hyperparameters", str(path), "--workers", "2"]
    assert tiny("--env", "own_ids:OwnPatrol-v0", *given) == 0, capsys.readouterr().err
    assert [row["steps"] for row in lines(tmp_path / "out")] == [0, 32]


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("--algo", "dqn"), "algo must be one of 'ppo', 'recurrent-ppo', got 'dqn'"),
        (("--env", "DoorPatrols-v0"), "DoorPatrols"),
        (("--env", "DoorCorridor-v0"), "DoorCorridor-v0 is no patrol"),
        (("--env", "no_such:Own-v0"), "the module of no_such:Own-v0 cannot be imported"),
        (("--world", "moon"), "unknown world 'moon'; known: corridor, loop, office, crowd"),
        (("--world", "loup"), "unknown world 'loup'; did you mean loop?"),
        (("--world", "no.json"), "no.json"),
        (("--slam", "magic"), "unknown SLAM variant 'magic'"),
        (("--scan-every", "3"), "hold must be a multiple of scan_every, got 4 and 3"),
        (("--workers", "0"), "workers must be a whole number of at least 1"),
        (("--workers", "3"), "num_envs must be a multiple of workers, got 2 and 3"),
        (("--seed", "-1"), "seed must be a whole number of at least 0"),
        (("--steps", "0"), "steps must be a whole number of at least 1"),
        (("--hyperparameters", "/nowhere.yml"), "/nowhere.yml"),
    ],
)
def test_mistakes_are_told_in_one_line_and_nothing_is_written(
    tiny, tmp_path, capsys, arguments, told
):
    assert tiny(*arguments) == 2
    error = capsys.readouterr().err
    assert told in error
    assert len(error.strip().splitlines()) == 1
    assert not (tmp_path / "out" / "config.json").exists()


@pytest.mark.parametrize(
    ("line", "told"),
    [
        ("normalize: true", "ppo does not take these hyperparameters"),
        ("policy_kwargs: dict(many=1)", "ppo does not take these hyperparameters"),
        ("n_steps: 1.5", "n_steps must be a whole number"),
        ("n_timesteps: many", "n_timesteps must be a finite number of at least 1"),
    ],
)
def test_hyperparameters_that_are_none_can_be_put_right_in_the_same_folder(
    tiny, tmp_path, capsys, line, told
):
    path = tmp_path / "tiny.yml"
    path.write_text(TINY + f"  {line}\n")
    assert tiny() == 2
    assert told in capsys.readouterr().err
    path.write_text(TINY)
    assert tiny("--steps", "1") == 0


def test_ctrl_c_is_told_and_keeps_what_is_there(tiny, tmp_path, monkeypatch, capsys):
    from agents.vec_env import NativeVecEnv

    step, left = NativeVecEnv.step_wait, STEPS + 10  # within the first rollout

    def interrupted(self):
        nonlocal left
        left -= 1
        if not left:
            raise KeyboardInterrupt
        return step(self)

    monkeypatch.setattr(NativeVecEnv, "step_wait", interrupted)
    assert tiny() == 130
    assert "with --resume continues" in capsys.readouterr().err
    assert (tmp_path / "out" / "checkpoint.zip").exists()
    assert [row["steps"] for row in lines(tmp_path / "out")] == [0]
    assert tiny("--resume") == 0
    assert [row["steps"] for row in lines(tmp_path / "out")] == [0, 32]


@pytest.mark.parametrize("workers", ["1", "2"])
def test_a_world_of_ones_own_is_trained_in(tiny, tmp_path, workers):
    path = tmp_path / "own_world.py"
    path.write_text(
        "from dynslam_env import Corridor\n"
        "class Short:\n"
        "    def layout(self, rng):\n"
        "        return Corridor(length=6.0, doors_per_side=2).layout(rng)\n"
    )
    world = f"{path}:Short"
    assert tiny("--world", world, "--workers", workers, "--steps", "32") == 0
    config = json.loads((tmp_path / "out" / "config.json").read_text())
    assert config["parameters"]["world"] == world
    assert [row["steps"] for row in lines(tmp_path / "out")] == [0, 32]


def test_viewpoints_are_trained_on_tables_of_floors(tmp_path, monkeypatch, capsys):
    from agents.viewpoints import ppo
    from agents.viewpoints import train as training

    small = ppo.Settings(patrols=2, length=4, updates=1, batch=8, judging=8)
    wanted = ("office", 0, 16, 1, 1, small)
    monkeypatch.setattr(training.ViewpointTraining.__init__, "__defaults__", wanted)
    given = ["train", "--env", "DoorPatrol-v1", "--steps", "16", "--out", str(tmp_path / "out")]
    assert main.status(given) == 0
    told = capsys.readouterr()
    assert "best.npz greedy --env DoorPatrol-v1 --worlds office --split test" in told.out
    assert "16 decisions  Brier of doors" in told.err
    rows = lines(tmp_path / "out")
    assert [row["steps"] for row in rows] == [0, 8, 16]
    assert all(0.0 < row["door_brier"] < 0.4 for row in rows)
    assert main.status(given) == 2
    assert "continue it by --resume" in capsys.readouterr().err
    assert main.status([*given, "--resume"]) == 0
    assert lines(tmp_path / "out") == rows
    row = Patrol("office", "hmm-ml", str(tmp_path / "out" / "best.npz"), 0, 5,
                 env="DoorPatrol-v1")().row  # fmt: skip
    assert row["error"] is None
    assert main.status([*given, "--algo", "recurrent-ppo"]) == 2
    assert "one algorithm, and no --hyperparameters" in capsys.readouterr().err
    assert main.status([*given, "--scan-every", "4"]) == 2
    assert "learns without a SLAM, and has no --scan-every" in capsys.readouterr().err


@pytest.mark.parametrize(("option", "value"), [("slam", "hmm-ml"), ("workers", "2")])
def test_viewpoints_are_learned_without_a_slam(tmp_path, capsys, option, value):
    given = "--env", "DoorPatrol-v1", f"--{option}", value, "--out", str(tmp_path / "out")
    assert main.status(["train", *given]) == 2
    assert f"learns without a SLAM, and has no --{option}" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_the_options_of_a_world_that_was_trained_on():
    assert worlds_option("loop") == "--worlds loop --split test"
    assert worlds_option("my world.json") == "--worlds 'my world.json'"
