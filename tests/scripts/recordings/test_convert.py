# pyright: reportMissingImports=false
"""`dynslam info` and `dynslam convert`."""

import json
from pathlib import Path

import numpy as np
import pytest
from dynslam_cli import main

from slam.episode import Episode
from slam.io.formats import read_log


def told(arguments: list[str], capsys) -> dict:
    assert main.status(["info", *arguments, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def test_info_of_a_log(log: Path, capsys):
    assert main.status(["info", str(log)]) == 0
    out = capsys.readouterr().out
    assert "CARMEN log" in out
    assert "80 in 7.9 s, 10.0 a second" in out
    assert "181 beams over 180 degrees" in out
    found = told([str(log)], capsys)
    assert found["scans"] == 80
    assert found["odometry"] == "in it"
    assert found["metres"] > 1.0


@pytest.mark.parametrize("ending", [".npz", ".csv", ".log.gz", ".bag", ".mcap", ".db3", ""])
def test_convert_to_all_formats(log: Path, tmp_path: Path, short_episode: Episode, ending, capsys):
    target = tmp_path / f"b{ending}"
    assert main.status(["convert", str(log), str(target)]) == 0
    assert "80 scans" in capsys.readouterr().out
    again = read_log(target).episode
    assert np.allclose(again.times, read_log(log).episode.times, atol=1e-6)
    old = short_episode.odometry.at(short_episode.times)
    assert np.allclose(again.odometry.at(again.times), old, atol=1e-5)
    assert main.status(["convert", str(log), str(target)]) == 2
    assert "is there already" in capsys.readouterr().err


def test_a_bag_tells_its_topics(log: Path, tmp_path: Path, capsys):
    bag = tmp_path / "b.bag"
    main.status(["convert", str(log), str(bag)])
    capsys.readouterr()
    assert main.status(["info", str(bag)]) == 0
    out = capsys.readouterr().out
    assert "ROS 1" in out
    assert "/scan" in out
    assert "sensor_msgs/msg/LaserScan" in out
    found = told([str(bag)], capsys)
    assert {topic["topic"] for topic in found["topics"]} == {"/scan", "/odom", "/tf", "/tf_static"}
    assert found["odometry"] == "/odom"


def test_an_unknown_ending_is_told_before_all_work(log: Path, tmp_path: Path, capsys):
    assert main.status(["convert", str(log), str(tmp_path / "b.xyz")]) == 2
    err = capsys.readouterr().err
    assert ".mcap" in err
    assert err.count("\n") == 1


def test_the_laser_can_be_said_to_stand_elsewhere(log: Path, capsys):
    found = told([str(log), "--mount", "0.2", "-0.1", "180"], capsys)
    assert found["mount"] == pytest.approx([0.2, -0.1, 180.0])
    assert main.status(["info", str(log), "--mount", "nan", "0", "0"]) == 2


def test_no_odometry_is_found_from_the_scans(log: Path, tmp_path: Path, capsys):
    found = told([str(log), "--odometry", "none"], capsys)
    assert found["odometry"] is None
    arguments = ["run", str(log), "--odometry", "none", "--slam", "static-ml"]
    assert main.status([*arguments, "--out", str(tmp_path / "out")]) == 0
    assert main.status(["info", str(log), "--laser", "/scan"]) == 2
    assert "only a ROS bag has several lasers" in capsys.readouterr().err
