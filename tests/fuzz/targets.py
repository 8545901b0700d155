"""Every file that dynslam reads: a small valid one, and what reads it and uses what was read."""

from __future__ import annotations

import io
import json
import math
import tempfile
import warnings
import zlib
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from PIL import Image
from PIL.PngImagePlugin import PngInfo

import slam
from agents.training.settings import arguments, read_settings
from agents.training.training_folder import CONFIG, find_checkpoint
from dynslam_env.simulation.find_world import find_world
from dynslam_env.worlds.map_doors import hung, read_gaps
from scripts.bench.user_suite import read_suite
from scripts.console.config_file import with_config
from scripts.mapping.map import MapCommand
from scripts.outside.adapter import read_adapter
from scripts.report.scores import QUALITY, present
from scripts.report.summary import Summary
from scripts.trials.recorded_run import RecordedRun, load, record_run, save
from scripts.trials.results import read_rows
from slam.episode import Episode
from slam.errors import InputError
from slam.forecast.door import DoorForecast
from slam.geometry import wrap_angle
from slam.grid import OccupancyGrid
from slam.io.door_memory import RememberedDoor
from slam.io.door_runs import read_door_runs
from slam.io.forecast_file import load_forecast, packed_forecast, save_forecast
from slam.io.guard import guarded
from slam.io.kitti import read_kitti, write_kitti
from slam.io.layers import picture, read_layers, write_layers
from slam.io.loaded_recording import LoadedRecording
from slam.io.pictures import read_picture
from slam.io.tum import read_tum, write_tum
from slam.layers import Layers
from slam.layers.doors import MappedDoor
from slam.preprocessing.clock import synchronised
from slam.preprocessing.deskewing import deskewed
from slam.sessions.session import Session, session_of
from slam.trajectory import Trajectory
from tests.fuzz.oracles import assert_episode, assert_kept, episode_again
from tests.fuzz.policies import (
    read_checkpoint,
    read_trained,
    read_viewpoints,
    save_sample,
    slim_sample,
    viewpoints_sample,
)
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


ADAPTER = b"""commands = ["{python} run.py {log} {out}", "sort {out}"]
prepare = ["head -1 {log}"]
log = "csv"
max_beams = 180
columns = "stamp x y theta"
offset = 0.5
programs = {SOME = "python3"}
version = "echo 1"
"""
OPTIONS = b"""file = "drive.npz"
laser = ["/front", "/back"]
mount = [0.2, 0.0, -180.0]
from = 2
max_range = 12
start = [1, 2, -3]
align = true
seed = 4
"""
RECTANGLE = [[0.0, 0.0], [0.9, 0.0], [0.9, 0.1], [0.0, 0.1], [0.0, 0.0]]
DOORS = {
    "type": "FeatureCollection",
    "features": [
        {
            "type": "Feature",
            "geometry": {"type": "Polygon", "coordinates": [RECTANGLE]},
            "properties": {"probability": 0.9},
        }
    ],
}
SHARE = 32  # of the files that are accepted, one in so many is written and read again


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
        Target("session.npz", _file(lambda path: _session().save(path)), _read_session),
        Target("layers.npz", _file(lambda path: write_layers(doors(30, 60, 2), path)), _layers),
        Target("forecast.npz", _file(_write_forecast), _forecast),
        Target("plain.pgm", _picture("PPM"), _read_picture),
        Target("map.png", _picture("PNG"), _read_picture),
        Target("map.bmp", _picture("BMP"), _read_picture),
        Target("some.kitti", _file(_write_kitti), _kitti),
        Target("runs.csv", b"begin_s,end_s,state\n0,600,1\n900,1500.5,0\n", read_door_runs),
        Target("run.npz", _file(_write_run), _run),
        Target("doors.geojson", json.dumps(DOORS).encode(), _gaps),
        Target("adapter.toml", ADAPTER, read_adapter),
        Target("options.toml", OPTIONS, _options),
        Target("world.json", json.dumps(WORLD).encode(), lambda path: find_world(str(path))),
        Target("suite.toml", SUITE, _suite),
        Target("settings.yml", SETTINGS, _settings),
        Target("results.jsonl", _results(), _summary),
        Target(CONFIG, b'{"steps": 10, "seed": 0, "settings": {"n_envs": 4}}', _config),
        Target("policy.zip", _file(slim_sample), read_trained),
        Target("checkpoint.zip", _file(save_sample), read_checkpoint),
        Target("viewpoints.npz", _file(viewpoints_sample), read_viewpoints),
    ]  # fmt: skip
    return {target.name: target for target in (*recordings, *others)}


def _reads(name: str) -> Callable[[Path], object]:
    read = reader_of(name)

    def use(path: Path) -> object:
        found = read(path)
        if isinstance(found, LoadedRecording):
            _drive(found, path)
        elif isinstance(found, OccupancyGrid):
            assert found.occupied.shape == found.spec.shape
            known = found.occupied[~np.isnan(found.occupied)]
            assert (np.abs(known - 0.5) <= 0.5).all(), "h is no probability"
        elif isinstance(found, Trajectory):
            _kept(found, path, _tum_again)
        return found

    return use


def _kept(found: Any, path: Path, again: Callable[[Any, Path], Any]) -> None:
    if zlib.crc32(path.read_bytes()) % SHARE == 0:
        assert_kept(found, again, path.with_name(f"again{path.suffix}"))


def _drive(log: LoadedRecording, path: Path) -> None:
    """What every command does with a recording, on its first scans, kernels and all."""
    assert_episode(log.episode)
    assert all(str(warned).isprintable() for warned in log.warnings)
    _kept(log.episode, path, episode_again)
    episode = deskewed(log.episode)
    assert np.isfinite(episode.times).all()
    first = episode.scans[:5]
    shown = Episode(first, episode.odometry, meta=episode.meta)
    if len(first) > 2:
        synchronised(shown)
    robot = slam.make("odometry")
    with suppress(InputError):  # of a map that would be too large: the command ends with it
        for motion, scan in zip(shown.displacements(), first, strict=True):
            assert np.isfinite(robot.update(motion, scan).pose).all()


def _tum_again(found: Trajectory, path: Path) -> Trajectory:
    write_tum(found, path)
    other = read_tum(path)
    np.testing.assert_allclose(other.poses[:, :2], found.poses[:, :2], rtol=1e-9, atol=1e-6)
    turned = wrap_angle(other.poses[:, 2] - found.poses[:, 2])
    np.testing.assert_allclose(turned, 0.0, atol=1e-6)
    return replace(other, poses=found.poses)


def _read_session(path: Path) -> Session:
    found = Session.load(path)
    list(found.keyframes())
    _kept(replace(found, doors=()), path, _session_again)
    return found


def _session_again(found: Session, path: Path) -> Session:
    found.save(path)
    return Session.load(path)


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


def _picture(kind: str) -> bytes:
    """A map as picture editors write it."""
    cells = np.random.default_rng(0).choice(np.array([0, 205, 254], np.uint8), (12, 17))
    if kind == "PPM":  # as text
        return b"P2\n# by hand\n17 12\n255\n" + b" ".join(b"%d" % cell for cell in cells.flat)
    file = io.BytesIO()
    told = PngInfo()
    told.add_text("Comment", "by hand", zip=True)
    told.add_itxt("Title", "hall", zip=True)
    others = {"transparency": 0, "dpi": (72, 72), "pnginfo": told} if kind == "PNG" else {}
    Image.fromarray(cells).save(file, kind, **others)
    return file.getvalue()


def _read_picture(path: Path) -> object:
    with guarded(path), warnings.catch_warnings():
        warnings.simplefilter("error")
        found = read_picture(path)
    assert found.ndim == 2
    assert found.dtype == np.uint8
    return found


def _layers(path: Path) -> object:
    found = read_layers(path)
    _kept(found, path, _layers_again)
    return picture(found)


def _layers_again(found: Layers, path: Path) -> Layers:
    write_layers(found, path)
    return read_layers(path)


def _write_forecast(path: Path) -> None:
    save_forecast(slam.DoorForecast.fit([0.0, 7200.0], [3600.0, 9000.0], [1, 0]), path)


def _forecast(path: Path) -> object:
    door = load_forecast(path)
    probability = door.ahead(np.array([1e9]))
    assert ((probability >= 0) & (probability <= 1)).all(), "no probability"
    _kept(packed_forecast(door), path, lambda _, other: _forecast_again(door, other))
    return door


def _forecast_again(door: DoorForecast, path: Path) -> object:
    save_forecast(door, path)
    return packed_forecast(load_forecast(path))


def _kitti(path: Path) -> object:
    poses = read_kitti(path)
    assert np.isfinite(poses).all()
    return poses


def _write_run(path: Path) -> None:
    save(record_run("odometry", small_drive(truth=True), 0), path)


def _run(path: Path) -> object:
    found = load(path)
    _kept(found, path, _run_again)
    return found


def _run_again(found: RecordedRun, path: Path) -> RecordedRun:
    save(found, path)
    return load(path)


def _gaps(path: Path) -> object:
    walls = np.array([[0.0, 0.0, 4.0, 0.0]])
    made = [hung(gap, walls) for gap in read_gaps(path, 0.5)]
    assert all(math.isfinite(door.width) and math.isfinite(door.closed) for door in made)
    return made


def _options(path: Path) -> object:
    return with_config(MapCommand, ["--config", str(path)])


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
