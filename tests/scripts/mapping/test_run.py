# pyright: reportMissingImports=false
import json
from pathlib import Path

import numpy as np
import pytest
from dynslam_cli import main
from dynslam_cli.mapping import run_recording
from PIL import Image

from agents import record_corridor
from slam.benchmark.run import Playback
from slam.episode import Episode
from slam.io.carmen.writer import write_carmen
from slam.io.ros_map import read_ros_map
from slam.io.tum import read_tum
from slam.trajectory import Trajectory


def test_writes_all_that_it_promises(log: Path, tmp_path: Path, capsys):
    out = tmp_path / "new" / "out"
    arguments = ["run", str(log), "--slam", "static-ml", "--out", str(out), "--json"]
    assert main.status(arguments) == 0
    told = json.loads(capsys.readouterr().out.splitlines()[-1])
    written = json.loads((out / "metrics.json").read_text())
    assert told["scans"] == written["scans"] == 80
    assert 0 < told["matched"] <= 80
    assert told["ms_per_matched_scan"] == pytest.approx(1e3 * told["seconds"] / told["matched"])
    trajectory = read_tum(out / "trajectory.tum")
    assert len(trajectory) == 80
    assert trajectory.times[1] - trajectory.times[0] == pytest.approx(0.1, abs=1e-5)
    assert (read_ros_map(out / "map.yaml").occupied == 1).sum() > 50
    with Image.open(out / "map.png") as picture:
        assert min(picture.size) > 100


def test_relations_are_scored(log: Path, tmp_path: Path, short_episode, capsys):
    times = short_episode.times
    relations = tmp_path / "relations"
    relations.write_text(f"{times[0]:.6f} {times[40]:.6f} 1.0 0 0 0 0 0\n")
    arguments = ["run", str(log), "--relations", str(relations), "--out", str(tmp_path / "out")]
    assert main.status([*arguments, "--slam", "odometry", "--json"]) == 0
    told = json.loads(capsys.readouterr().out.splitlines()[-1])
    start, end = short_episode.odometry.at(times[[0, 40]])
    c, s = np.cos(start[2]), np.sin(start[2])
    dx, dy = (end - start)[:2]
    expected = np.hypot(c * dx + s * dy - 1.0, -s * dx + c * dy)
    assert told["relations"] == 1
    assert told["translation_mean"] == pytest.approx(expected, abs=1e-4)


def test_the_same_log_gives_the_same_bytes(log: Path, tmp_path: Path):
    for name in "ab":
        assert main.status(["run", str(log), "--out", str(tmp_path / name)]) == 0
    for file in ("trajectory.tum", "map.pgm", "map.yaml", "map.png"):
        assert (tmp_path / "a" / file).read_bytes() == (tmp_path / "b" / file).read_bytes()


def test_ctrl_c_keeps_what_is_done(log: Path, tmp_path: Path, monkeypatch, capsys):
    class Impatient(Playback):
        def __iter__(self):
            for number, estimate in enumerate(super().__iter__()):
                if number == 30:
                    raise KeyboardInterrupt
                yield estimate

    monkeypatch.setattr(run_recording, "Playback", Impatient)
    assert main.status(["run", str(log), "--out", str(tmp_path / "out")]) == 130
    assert "interrupted" in capsys.readouterr().err
    assert len(read_tum(tmp_path / "out" / "trajectory.tum")) == 31
    assert json.loads((tmp_path / "out" / "metrics.json").read_text())["interrupted"]


def test_ctrl_c_before_the_first_scan_leaves_an_earlier_result_alone(
    log: Path, tmp_path: Path, monkeypatch
):
    def interrupted(variant, episode):
        raise KeyboardInterrupt

    assert main.status(["run", str(log), "--out", str(tmp_path / "out")]) == 0
    before = (tmp_path / "out" / "metrics.json").read_bytes()
    monkeypatch.setattr(run_recording, "compile_first", interrupted)
    assert main.status(["run", str(log), "--out", str(tmp_path / "out")]) == 130
    assert (tmp_path / "out" / "metrics.json").read_bytes() == before


def test_a_scan_that_no_map_can_hold_ends_the_run_and_keeps_the_rest(
    short_episode: Episode, tmp_path: Path, capsys
):
    poses = short_episode.odometry.poses.copy()
    poses[10:, :2] += 1e5
    leaping = Episode(short_episode.scans, Trajectory(short_episode.odometry.times, poses))
    write_carmen(leaping, tmp_path / "leap.log")
    arguments = ["run", str(tmp_path / "leap.log"), "--slam", "odometry", "--out"]
    assert main.status([*arguments, str(tmp_path / "out")]) == 2
    assert "does the odometry leap?" in capsys.readouterr().err
    assert len(read_tum(tmp_path / "out" / "trajectory.tum")) == 10


def test_relations_outside_the_log_are_told(log: Path, tmp_path: Path, capsys):
    relations = tmp_path / "relations"
    arguments = ["run", str(log), "--relations", str(relations), "--out", str(tmp_path / "out")]
    relations.write_text("1 2 1.0 0 0 0 0 0\n1 1e9 1.0 0 0 0 0 0\n")
    assert main.status(arguments) == 0
    assert "1 relations left out" in capsys.readouterr().err
    relations.write_text("1e9 1.1e9 1.0 0 0 0 0 0\n")
    assert main.status(arguments) == 2
    assert "all lie outside those of" in capsys.readouterr().err


def test_a_garbled_line_is_counted_and_the_rest_used(log: Path, tmp_path: Path, capsys):
    lines = log.read_text().splitlines()
    broken = next(k for k, line in enumerate(lines) if line.startswith(("FLASER", "ROBOTLASER")))
    lines[broken] = lines[broken][: len(lines[broken]) // 2]
    log.write_text("\n".join(lines) + "\n")
    assert main.status(["run", str(log), "--out", str(tmp_path / "out"), "--json"]) == 0
    captured = capsys.readouterr()
    assert "warning" in captured.err
    assert f"line {broken + 1}" in captured.err
    assert json.loads(captured.out.splitlines()[-1])["scans"] == 79


def metrics_of(log: Path, tmp_path: Path, capsys, *arguments: str) -> dict:
    given = ["run", str(log), "--slam", "odometry", "--out", str(tmp_path / "out"), "--json"]
    assert main.status([*given, *arguments]) == 0
    return json.loads(capsys.readouterr().out.splitlines()[-1])


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("none", None),
        ("0.2", {"offset_s": 0.2, "stamp": "begin"}),
        ("-0.3", {"offset_s": -0.3, "stamp": "begin"}),
        ("0,end", {"offset_s": 0.0, "stamp": "end"}),
        ("-0.05,end", {"offset_s": -0.05, "stamp": "end"}),
    ],
)
def test_a_clock_can_be_set(log: Path, tmp_path: Path, text: str, told, capsys):
    assert metrics_of(log, tmp_path, capsys, "--clock", text)["clock"] == told


@pytest.mark.parametrize("text", ["", "later", "0.2,middle", "nan", "11", "0.2,end,end", ",end"])
def test_a_clock_that_is_none_is_refused(log: Path, text: str, capsys):
    assert main.status(["run", str(log), "--clock", text]) == 2
    assert "--clock is auto, none, or SECONDS" in capsys.readouterr().err


def test_a_late_odometry_is_corrected_unless_told_otherwise(tmp_path: Path, capsys):
    drive = record_corridor(6103, "moving")
    late = Trajectory(drive.times, drive.odometry.at(drive.times - 0.3))
    log = tmp_path / "late.log"
    write_carmen(Episode(drive.scans, late), log)
    found = metrics_of(log, tmp_path, capsys)["clock"]
    assert found["offset_s"] == pytest.approx(0.3, abs=0.03)
    poses = read_tum(tmp_path / "out" / "trajectory.tum").poses
    assert metrics_of(log, tmp_path, capsys, "--clock", "none")["clock"] is None
    left = read_tum(tmp_path / "out" / "trajectory.tum").poses
    right = drive.odometry.at(drive.times)
    assert np.abs(poses - right)[:-4, :2].max() < 0.03 < 0.1 < np.abs(left - right)[:, :2].max()
