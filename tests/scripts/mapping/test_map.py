# pyright: reportMissingImports=false
"""`dynslam map`: all that one takes away from a recording."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from dynslam_cli import main
from dynslam_cli.mapping import map_recording
from dynslam_cli.recordings import preparation
from PIL import Image

from slam.benchmark.run import Playback
from slam.episode import Episode
from slam.io.episode_file import save_episode
from slam.io.formats import read_log, write_log
from slam.io.kitti import read_kitti
from slam.io.layers import read_layers
from slam.io.ros_map import read_ros_map
from slam.io.tum import read_tum
from slam.sessions.session import Session
from slam.trajectory import Trajectory
from tests.slam.worlds import drive

QUICK = ["--skip", "rrd,mcap"]


def mapped(log: Path, out: Path, *more: str) -> int:
    return main.status(["map", str(log), "--out", str(out), "--slam", "static-ml", *more])


@pytest.fixture(scope="module")
def made(tmp_path_factory, short_episode: Episode) -> Path:
    """What comes of the short drive, all of it."""
    folder = tmp_path_factory.mktemp("map")
    write_log(short_episode, folder / "drive.npz")
    arguments = ["map", str(folder / "drive.npz"), "--out", str(folder / "out")]
    assert main.status([*arguments, "--slam", "static-graph", "--film", "--page"]) == 0
    return folder / "out"


def test_writes_all_that_it_says(made: Path):
    summary = json.loads((made / "summary.json").read_text())
    assert {path.name for path in made.iterdir()} == set(summary["files"])
    assert summary["scans"] == 80
    assert summary["slam"] == "static-graph"


def test_a_film_and_a_page_are_made_on_demand_only(log: Path, tmp_path: Path, capsys):
    assert mapped(log, tmp_path / "out") == 0
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert {"map.yaml", "layers.png", "map.mcap", "map.rrd"} <= names
    assert not [name for name in names if name.startswith("film") or name.endswith(".html")]
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["seconds_in_all"] > summary["seconds"] > 0
    told = capsys.readouterr().out
    assert f"{summary['seconds']:.1f} s, {summary['seconds_in_all']:.1f} s with all files" in told
    assert "earlier run" not in told


def test_files_of_an_earlier_run_are_told(log: Path, tmp_path: Path, capsys):
    assert mapped(log, tmp_path) == 0
    for _ in range(2):  # the second run finds them in the summary of the first
        assert mapped(log, tmp_path, *QUICK) == 0
        assert "of an earlier run, not written again: map.mcap, map.rrd" in capsys.readouterr().out
    (tmp_path / "summary.json").write_text("[]")
    assert mapped(log, tmp_path, *QUICK) == 0
    assert json.loads((tmp_path / "summary.json").read_text())["of_earlier_run"] == []


def test_the_files_agree(made: Path):
    trajectory, session = read_tum(made / "trajectory.tum"), Session.load(made / "session.npz")
    assert np.allclose(trajectory.poses, session.poses, atol=1e-6)
    assert np.allclose(read_kitti(made / "trajectory.kitti"), session.poses, atol=1e-6)
    layers, grid = read_layers(made / "layers.npz"), read_ros_map(made / "map.yaml")
    assert grid.spec == layers.spec
    assert np.array_equal(grid.occupied == 1, layers.static | layers.kept)
    assert np.array_equal(grid.observed, ~layers.unknown)
    with Image.open(made / "layers.png") as picture:
        assert min(picture.size) > 500
    doors = json.loads((made / "doors.geojson").read_text())
    assert doors["type"] == "FeatureCollection"
    again = read_log(made / "map.mcap").episode
    assert len(again.scans) == 80


def test_the_same_recording_gives_the_same_bytes(log: Path, tmp_path: Path):
    for name in "ab":
        assert mapped(log, tmp_path / name, *QUICK) == 0
    for path in (tmp_path / "a").iterdir():
        if path.suffix not in (".npz", ".json"):  # stamps of the packing, times of the run
            assert path.read_bytes() == (tmp_path / "b" / path.name).read_bytes(), path.name


def test_goes_on_with_a_map_and_localises_in_it(log: Path, made: Path, tmp_path: Path, capsys):
    onto = ["--onto", str(made / "session.npz"), "--start", "0", "0", "0", *QUICK]
    assert main.status(["map", str(log), "--out", str(tmp_path / "both"), *onto]) == 0
    assert len(Session.load(tmp_path / "both" / "session.npz").scans) == 160
    arguments = ["map", str(log), "--out", str(tmp_path / "found"), "--localise", *onto, "--json"]
    assert main.status(arguments) == 0
    told = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert told["slam"] == "hmm-ml"
    assert "session.npz" not in told["files"]
    found, old = read_tum(tmp_path / "found" / "trajectory.tum"), Session.load(made / "session.npz")
    assert np.hypot(*(found.poses - old.poses)[:, :2].T).max() < 0.1


def test_a_recording_of_another_place_is_refused(made: Path, tmp_path: Path, capsys):
    write_log(drive(n=40, bias=0.0), tmp_path / "other.npz")
    onto = ["--onto", str(made / "session.npz"), *QUICK]
    arguments = ["map", str(tmp_path / "other.npz"), "--out", str(tmp_path / "out"), *onto]
    assert main.status(arguments) == 2
    assert "does not seem to begin within the map" in capsys.readouterr().err
    assert not list((tmp_path / "out").iterdir())


def test_a_wrong_start_is_told_and_mended(log: Path, made: Path, tmp_path: Path, capsys):
    onto = ["--onto", str(made / "session.npz"), "--start", "1", "1", "90", *QUICK]
    arguments = ["map", str(log), "--out", str(tmp_path), "--localise", *onto, "--json"]
    assert main.status(arguments) == 0
    out, err = capsys.readouterr()
    told = json.loads(out.splitlines()[-1])
    (warning,) = told["warnings"]
    assert warning.startswith("--start 1.00 1.00 90.0 seems to be wrong")
    assert f"warning: {warning}" in err
    found, old = read_tum(tmp_path / "trajectory.tum"), Session.load(made / "session.npz")
    assert np.hypot(*(found.poses - old.poses)[:, :2].T).max() < 0.1


@pytest.mark.parametrize("localise", [True, False])
def test_a_graph_goes_on_with_a_map_and_localises_in_it(
    log: Path, made: Path, tmp_path: Path, localise: bool
):
    onto = ["--onto", str(made / "session.npz"), *QUICK, "--slam", "static-graph"]
    more = ["--localise"] if localise else []
    assert main.status(["map", str(log), "--out", str(tmp_path), *onto, *more]) == 0
    found, old = read_tum(tmp_path / "trajectory.tum"), Session.load(made / "session.npz")
    assert np.hypot(*(found.poses - old.poses)[:, :2].T).max() < 0.1
    assert (tmp_path / "session.npz").exists() is not localise


def test_is_scored_against_a_reference(log: Path, made: Path, tmp_path: Path, capsys):
    arguments = ["--truth", str(made / "trajectory.tum"), "--json", *QUICK]
    assert mapped(log, tmp_path, *arguments) == 0
    told = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert told["ate_aligned"] < 0.05


def test_ctrl_c_keeps_what_is_done(log: Path, tmp_path: Path, monkeypatch, capsys):
    whole = Playback.__iter__

    def impatient(self):
        for number, estimate in enumerate(whole(self)):
            if number == 40:
                raise KeyboardInterrupt
            yield estimate

    monkeypatch.setattr(Playback, "__iter__", impatient)
    assert mapped(log, tmp_path, *QUICK) == 130
    assert "interrupted, writing what is done" in capsys.readouterr().err
    assert json.loads((tmp_path / "summary.json").read_text())["interrupted"]
    assert len(read_tum(tmp_path / "trajectory.tum")) == 41  # the one under way is finished


@pytest.mark.parametrize(
    ("more", "why"),
    [
        (["--localise"], "need a map"),
        (["--start", "0", "0", "0"], "need a map"),
        (["--skip", "doors"], "unknown part 'doors'"),
        (["--truth", "none.tum"], "no such file"),
        (["--onto", "none.npz"], "no such file"),
        (["--onto", "none.npz", "--start", "nan", "0", "0"], "three finite numbers"),
        (["--slam", "nonsense"], "unknown SLAM variant"),
        (["--laser", "/scan"], "only a ROS bag"),
    ],
)
def test_mistakes_are_told_in_one_line(log: Path, tmp_path: Path, more, why, capsys):
    assert main.status(["map", str(log), "--out", str(tmp_path / "out"), *more]) == 2
    err = capsys.readouterr().err
    assert why in err
    assert err.count("\n") == 1
    assert not (tmp_path / "out").exists()


def test_a_reference_of_another_day_costs_no_map(log: Path, tmp_path: Path, capsys):
    (tmp_path / "other.tum").write_text("9e8 0 0 0 0 0 0 1\n9.1e8 1 0 0 0 0 0 1\n")
    assert mapped(log, tmp_path / "out", "--truth", str(tmp_path / "other.tum"), *QUICK) == 0
    assert "not scored" in capsys.readouterr().err
    assert (tmp_path / "out" / "map.yaml").exists()


def test_what_cannot_be_written_costs_nothing_else(tmp_path: Path, short_episode, capsys):
    scans = tuple(replace(scan, time=scan.time - 100) for scan in short_episode.scans)
    odometry = Trajectory(short_episode.odometry.times - 100, short_episode.odometry.poses)
    save_episode(Episode(scans, odometry), tmp_path / "early.npz")
    assert mapped(tmp_path / "early.npz", tmp_path / "out", "--skip", "rrd") == 2
    assert "mcap not written: a bag needs times" in capsys.readouterr().err
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["not_written"] == ["mcap"]
    assert {path.name for path in (tmp_path / "out").iterdir()} == set(summary["files"])


def test_a_map_is_not_written_over_by_what_goes_on_with_it(log: Path, made: Path, capsys):
    onto = ["--onto", str(made / "session.npz"), "--localise", *QUICK]
    before = (made / "map.png").read_bytes()
    assert main.status(["map", str(log), "--out", str(made), *onto]) == 2
    assert "needs another folder" in capsys.readouterr().err
    assert (made / "map.png").read_bytes() == before


def test_a_folder_or_variant_that_cannot_be_is_told_before_the_work(
    log: Path, made: Path, tmp_path: Path, monkeypatch, capsys
):
    monkeypatch.setattr(preparation, "poses_by_laser", lambda _: pytest.fail("worked first"))
    monkeypatch.setattr(map_recording, "start_in", lambda *_: pytest.fail("worked first"))
    (tmp_path / "file").write_text("")
    assert mapped(log, tmp_path / "file", "--odometry", "none") == 2
    assert "a directory that can be written" in capsys.readouterr().err
    onto = ["--onto", str(made / "session.npz"), "--slam", "dynamic-pf"]
    assert main.status(["map", str(log), "--out", str(tmp_path / "out"), *onto]) == 2
    assert "continued by a variant MAP-ml" in capsys.readouterr().err
