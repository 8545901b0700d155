# pyright: reportMissingImports=false
"""Two lasers of one robot, at two heights: /shared/data/jarvis_circular.bag."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from dynslam_cli import main
from dynslam_cli.mapping.lasers import Lasers
from dynslam_cli.recordings import source

from slam.geometry import Pose2
from slam.io.formats import read_log
from slam.io.ros_map import read_ros_map
from slam.sessions.session import Session
from tests.slam.worlds import drive

LASERS = "/driver_laser_navigation/laser_scan", "/driver_laser_security/laser_scan"
BOTH = ["--laser", LASERS[0], "--laser", LASERS[1]]
BARRIER = (3.65, 1.5)  # m: a low one, which the higher laser does not see


@pytest.fixture(scope="module")
def made(shared_data: Path, tmp_path_factory) -> tuple[Path, dict]:
    out = tmp_path_factory.mktemp("both")
    bag = str(shared_data / "jarvis_circular.bag")
    more = ["--truth", "/pose_ground_truth", "--skip", "rrd", "--out", str(out)]
    assert main.status(["map", bag, *BOTH, *more]) == 0
    return out, json.loads((out / "summary.json").read_text())


def test_all_scans_of_both_are_mapped_on_one_clock(made) -> None:
    out, summary = made
    assert summary["scans"] == 204 + 213
    assert summary["ate_aligned"] < 0.025
    scans = Session.load(out / "session.npz").scans
    assert {scan.mount.x for scan in scans} == {0.194, 0.895}
    assert (np.diff([scan.time for scan in scans]) > 0).all()


def test_what_only_the_lower_one_sees_stands_in_the_map(made, shared_data, tmp_path) -> None:
    out, _ = made
    bag = str(shared_data / "jarvis_circular.bag")
    more = ["--laser", LASERS[0], "--skip", "mcap,rrd", "--out", str(tmp_path)]
    assert main.status(["map", bag, *more]) == 0
    around = np.array(BARRIER) + np.array([(dx, 0.0) for dx in np.arange(-0.2, 0.2, 0.05)])
    both, one = (read_ros_map(folder / "map.yaml").sample(around)[0] for folder in (out, tmp_path))
    assert both.max() == 1.0
    assert one.max() == 0.0


def test_each_laser_has_a_frame_in_the_recording_of_the_result(made) -> None:
    out, _ = made
    from slam.io.bags.contents import contents_of

    topics = {one["topic"]: one["messages"] for one in contents_of(out / "map.mcap")["topics"]}
    assert topics["/scan_2"] == 213
    assert topics["/points"] == 204
    assert topics["/tf_static"] == 2
    again = read_log(out / "map.mcap").episode
    assert again.scans[0].mount.x == pytest.approx(0.895)


def test_both_can_be_converted_to_one_file(shared_data: Path, tmp_path: Path) -> None:
    bag = str(shared_data / "jarvis_circular.bag")
    assert main.status(["convert", bag, str(tmp_path / "both.npz"), *BOTH]) == 0
    assert len(read_log(tmp_path / "both.npz").episode.scans) == 417


def test_a_laser_that_stands_still_among_others_is_refused(
    shared_data: Path, tmp_path: Path, monkeypatch, capsys
) -> None:
    """As one whose driver repeats a scan."""
    real = source.RecordingSource.read

    def read(self, laser=None):
        log = real(self, laser)
        if laser == LASERS[1]:
            first = log.episode.scans[0]
            scans = tuple(replace(first, time=scan.time) for scan in log.episode.scans)
            log = log._replace(episode=replace(log.episode, scans=scans))
        return log

    monkeypatch.setattr(source.RecordingSource, "read", read)
    bag = str(shared_data / "jarvis_circular.bag")
    assert main.status(["map", bag, *BOTH, "--out", str(tmp_path / "out")]) == 2
    err = capsys.readouterr().err
    assert f"{LASERS[1]} does not turn with the robot" in err
    assert "leave it out" in err


def test_scans_are_told_apart_by_their_mounts() -> None:
    episode = drive(9, bias=0.0)
    mounts = Pose2(), Pose2(0.3, 0.0, 0.0)
    scans = tuple(replace(s, mount=mounts[k % 2]) for k, s in enumerate(episode.scans))
    two = replace(episode, scans=scans)
    lasers = Lasers.of_episode(two)
    assert lasers.mounts == mounts
    parts = lasers.of(Session(scans, np.arange(27.0).reshape(9, 3)))
    assert [len(part.scans) for part in parts] == [5, 4]
    assert parts[1].poses[:, 0].tolist() == [3.0, 9.0, 15.0, 21.0]
    assert len(Lasers.of_episode(episode).of(Session(scans, np.zeros((9, 3))))) == 1
    moving = tuple(replace(s, mount=Pose2(0.1 * k, 0, 0)) for k, s in enumerate(scans))
    assert Lasers.of_episode(replace(two, scans=moving)).mounts == ()
