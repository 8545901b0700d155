"""Every file that dynslam reads: a small valid one, and what reads it and uses what was read."""

from __future__ import annotations

import io
import json
import tempfile
import zipfile
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import slam
from agents.training.settings import arguments, read_settings
from agents.training.training_folder import CONFIG, find_checkpoint
from dynslam_env.patrol.env import DoorPatrolEnv
from dynslam_env.simulation.find_world import find_world
from scripts.bench.user_suite import read_suite
from scripts.report.scores import QUALITY, present
from scripts.report.summary import Summary
from scripts.trials.recorded_run import load, record_run, save
from scripts.trials.results import read_rows
from slam.episode import Episode
from slam.errors import InputError
from slam.forecast.door import DoorForecast
from slam.io.door_memory import RememberedDoor
from slam.io.door_runs import read_door_runs
from slam.io.forecast_file import load_forecast, save_forecast
from slam.io.guard import guarded
from slam.io.kitti import read_kitti, write_kitti
from slam.io.layers import picture, read_layers, write_layers
from slam.io.loaded_recording import LoadedRecording
from slam.layers.doors import MappedDoor
from slam.preprocessing.clock import synchronised
from slam.preprocessing.deskewing import deskewed
from slam.sessions.session import Session, session_of
from tests.scripts.results import rows
from tests.slam.io.samples import reader_of, samples, small_drive
from tests.slam.layers.test_layers import doors

SUITE = b"""name = "mine"
variants = ["odometry", "static-ml"]
seeds = 2
[[case]]
name = "one"
env = "DoorCorridor-v0"
max_episode_steps = 60
every = 2
world = { doors_per_side = 2 }
doors = { law = { kind = "Uniform", shortest = 1.0, longest = 2.0 } }
laser = { max_range = 4.0, effects = [{ kind = "RangeNoise", linear = 0.01 }] }
faults = [{ kind = "Slip", distance = 0.4, at = [1.0, 2.0] }]
[[case]]
env = "DoorLoop-v0"
odometry = { bias = 0.0 }
"""
WORLD = {
    "format": "dynslam-world-1",
    "walls": [[0, 0, 4, 0], [4, 0, 4, 4], [4, 4, 0, 4], [0, 4, 0, 0], [2.0, 0, 2, 1.5]],
    "doors": [{"hinge": [2.0, 3.0], "closed": 0.0, "swing": 1, "width": 0.9, "thickness": 0.04}],
    "start": [0.8, 0.8, 0.0],
    "path": [[0.8, 0.8], [1.4, 1.4]],
    "routes": [],
}
SETTINGS = b"""defaults: &defaults
  policy: MultiInputPolicy
  n_envs: 4
DoorPatrol-v0:
  <<: *defaults
  learning_rate: lin_0.0003
  clip_range: 0.2
  n_steps: 16
  policy_kwargs: "dict(net_arch=dict(pi=[8], vf=[8]))"
"""


class Target(NamedTuple):
    """A file's name, its bytes, and what reads it."""

    name: str
    data: bytes
    read: Callable[[Path], object]


@cache
def targets() -> dict[str, Target]:
    """By name."""
    recordings = [Target(name, data, _reads(name)) for name, data in samples().items()]
    others = [
        Target("session.npz", _file(lambda path: _session().save(path)), Session.load),
        Target("layers.npz", _file(lambda path: write_layers(doors(30, 60, 2), path)), _layers),
        Target("forecast.npz", _file(_write_forecast), _forecast),
        Target("some.kitti", _file(_write_kitti), read_kitti),
        Target("runs.csv", b"begin_s,end_s,state\n0,600,1\n900,1500.5,0\n", read_door_runs),
        Target("run.npz", _file(_write_run), load),
        Target("world.json", json.dumps(WORLD).encode(), lambda path: find_world(str(path))),
        Target("suite.toml", SUITE, _suite),
        Target("settings.yml", SETTINGS, _settings),
        Target("results.jsonl", _results(), _summary),
        Target(CONFIG, b'{"steps": 10, "seed": 0, "settings": {"n_envs": 4}}', _config),
        Target("policy.zip", _policy(), _trained),
    ]  # fmt: skip
    return {target.name: target for target in (*recordings, *others)}


def _reads(name: str) -> Callable[[Path], object]:
    read = reader_of(name)

    def use(path: Path) -> object:
        found = read(path)
        if isinstance(found, LoadedRecording):
            _drive(found)
        return found

    return use


def _drive(log: LoadedRecording) -> None:
    """What every command does with a recording, on its first scans, kernels and all."""
    episode = deskewed(log.episode)
    assert np.isfinite(episode.times).all()
    assert all(str(warned).isprintable() for warned in log.warnings)
    first = episode.scans[:5]
    shown = Episode(first, episode.odometry, meta=episode.meta)
    if len(first) > 2:
        synchronised(shown)
    robot = slam.make("odometry")
    with suppress(InputError):  # of a map that would be too large: the command ends with it
        for motion, scan in zip(shown.displacements(), first, strict=True):
            robot.update(motion, scan)


def _file(write: Callable[[Path], object]) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        write(Path(folder) / "some.npz")
        return (Path(folder) / "some.npz").read_bytes()


def _write_kitti(path: Path) -> None:
    write_kitti(small_drive().odometry, path)


def _session() -> Session:
    drive = small_drive()
    forecast = DoorForecast.fit([0.0, 60.0], [60.0, 120.0], [0, 1])
    door = MappedDoor(np.array([[0.0, 0.0], [0.9, 0.0]]), 0.5, 1, 9.0, 0, 9, 9, 9, 0.95)
    known = session_of(drive, np.zeros((len(drive.scans), 3)))
    return replace(known, doors=(RememberedDoor(door, forecast, 120.0),))


def _layers(path: Path) -> object:
    return picture(read_layers(path))


def _write_forecast(path: Path) -> None:
    save_forecast(slam.DoorForecast.fit([0.0, 7200.0], [3600.0, 9000.0], [1, 0]), path)


def _forecast(path: Path) -> object:
    door = load_forecast(path)
    return door.ahead(np.array([1e9]))


def _write_run(path: Path) -> None:
    save(record_run("odometry", small_drive(truth=True), 0), path)


def _suite(path: Path) -> object:
    suite = read_suite(path)
    return suite.trials(suite.variants[:1], range(1), 1.0) if "odometry" in suite.variants else None


def _settings(path: Path) -> object:
    with guarded(path):
        return arguments(read_settings("ppo", "DoorPatrol-v0", path))


def _results() -> bytes:
    return "".join(json.dumps(row) + "\n" for row in rows(2)).encode()


def _summary(path: Path) -> object:
    summary = Summary(read_rows(path))
    scores = present(QUALITY, summary.rows)
    return [group.values(score) for group in summary.groups.values() for score in scores]


def _config(path: Path) -> object:
    return find_checkpoint({"steps": 20, "seed": 0, "settings": {"n_envs": 4}}, path.parent, True)


@cache
def _patrol() -> Any:
    return DoorPatrolEnv()


def _policy() -> bytes:
    import torch
    from stable_baselines3.common.policies import MultiInputActorCriticPolicy

    env = _patrol()
    settings = {"policy": "MultiInputPolicy", "policy_kwargs": "dict(net_arch=[4])"}
    training = {"env": "DoorPatrol-v0", "algorithm": "ppo", "settings": settings}
    policy = MultiInputActorCriticPolicy(
        env.observation_space, env.action_space, lambda _: 0.0, net_arch=[4]
    )
    weights, file = io.BytesIO(), io.BytesIO()
    torch.save(policy.state_dict(), weights)
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as packed:
        packed.writestr("policy.pth", weights.getvalue())
        packed.writestr("dynslam.json", json.dumps(training))
    return file.getvalue()


def _trained(path: Path) -> object:
    from agents.trained import Trained

    return Trained(path, _patrol())
