# pyright: reportMissingImports=false
"""`dynslam info` and `dynslam convert`."""

import json
from pathlib import Path

import numpy as np
import pytest
from dynslam_cli import main
from dynslam_cli.bench.suites import logs
from dynslam_cli.recordings.description import _jumps_in_words

import slam
from agents import record_path
from dynslam_env import Slip
from slam.episode import Episode
from slam.errors import InputError
from slam.io import formats
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


def test_info_tells_jumps_of_the_odometry(tmp_path: Path, log: Path, capsys):
    slip = Slip(0.8, at=(4.0, 4.5), duration=0.1)
    jumping = tmp_path / "jumping.log"
    formats.write_log(
        record_path("DoorCorridor-v0", 1, max_episode_steps=80, faults=[slip]), jumping
    )
    assert main.status(["info", str(jumping)]) == 0
    assert "jumps, or scans are missing, once: after 4." in capsys.readouterr().out
    (jump,) = told([str(jumping)], capsys)["jumps"]
    assert jump["metres"] == pytest.approx(0.8, abs=0.1)
    assert told([str(log)], capsys)["jumps"] == []


def test_info_of_many_jumps_lists_the_first_ones():
    found = [{"s": 2.0 * k, "metres": 0.5, "degrees": -20.0} for k in range(5)]
    assert _jumps_in_words(found[:1]).endswith("once: after 0.0 s by 0.50 m and 20 degrees")
    told = _jumps_in_words(found)
    assert "5 times" in told
    assert told.count("after") == 3
    assert told.endswith("; ...")


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


LASERS = "/driver_laser_navigation/laser_scan", "/driver_laser_security/laser_scan"


def test_each_of_several_lasers_is_described(shared_data: Path, capsys):
    bag = shared_data / "jarvis_circular.bag"
    assert main.status(["info", str(bag)]) == 0
    out = capsys.readouterr().out
    assert "204 in 25.4 s, 8.0 a second" in out
    assert f"{LASERS[0]}, 1440 beams over 360 degrees, 0.5 to 250 m" in out
    assert "0.194 m ahead" in out
    assert "213 in 25.4 s, 8.3 a second" in out
    assert f"{LASERS[1]}, 761 beams over 190 degrees, 0.1 to 50 m" in out
    assert "0.895 m ahead" in out
    assert out.count("base_footprint in odom: 11.1 m, 1.0 turns") == 1
    found = told([str(bag)], capsys)
    assert [laser["laser"] for laser in found["lasers"]] == list(LASERS)
    assert [laser["scans"] for laser in found["lasers"]] == [204, 213]
    assert found["laser"] == LASERS[0]
    (one,) = told([str(bag), "--laser", LASERS[1]], capsys)["lasers"]
    assert one == found["lasers"][1]


def test_info_tells_the_clocks(shared_data: Path, log: Path, capsys):
    bag = shared_data / "jarvis_circular.bag"
    assert main.status(["info", str(bag), "--laser", LASERS[0]]) == 0
    out = capsys.readouterr().out
    assert "the odometry is 0.06" in out
    assert "s early (standard error 0.0" in out
    assert "stamps are of the end of a sweep" in out
    navigation, security = (laser["clock"] for laser in told([str(bag)], capsys)["lasers"])
    assert navigation["stamp"] == "end"
    assert security["stamp"] is None
    assert navigation["corrected_s"] == navigation["offset_s"]
    assert 0 < navigation["standard_error_s"] < 0.01
    clock = told([str(log)], capsys)["clock"]
    assert clock["corrected_s"] == 0
    assert clock["offset_s"] is None
    assert "could not be told" in clock["in_words"]


def test_a_laser_that_cannot_be_read_is_warned_of(shared_data: Path, monkeypatch, capsys):
    """The others are described; where there are none, the command says why."""
    bag = shared_data / "jarvis_circular.bag"
    unreadable: set[str | None] = {LASERS[0]}

    def read(path, choice):
        if choice.laser in unreadable:
            raise InputError(f"no usable scan on {choice.laser}")
        return read_log(path, choice)

    monkeypatch.setattr(formats, "read_log", read)
    assert main.status(["info", str(bag)]) == 0
    out, err = capsys.readouterr()
    assert "1440 beams" not in out
    assert "761 beams" in out
    assert err == f"warning: no usable scan on {LASERS[0]}\n"
    unreadable.add(LASERS[1])
    assert main.status(["info", str(bag)]) == 2
    assert f"no usable scan on {LASERS[0]}" in capsys.readouterr().err


def test_a_format_of_ones_own_is_known_to_the_commands(
    short_episode: Episode, tmp_path: Path, monkeypatch, capsys
):
    monkeypatch.setattr(formats, "_READERS", {})
    path = tmp_path / "a.own"
    path.write_bytes(b"OWN")
    slam.register_reader("own", lambda path, head: head == b"OWN", lambda path: short_episode)
    assert main.status(["info", str(path)]) == 0
    assert capsys.readouterr().out.startswith(
        f"{path}: own\n    scans  {len(short_episode.scans)} "
    )
    assert main.status(["convert", str(path), str(tmp_path / "a.npz")]) == 0
    assert len(read_log(tmp_path / "a.npz").episode.scans) == len(short_episode.scans)
    assert main.status(["run", str(path), "--slam", "odometry", "--out", str(tmp_path / "o")]) == 0
    assert [case.condition for case in logs(tmp_path).cases] == [{"log": "a"}, {"log": "a.own"}]


def test_scans_that_come_in_bursts_have_two_rates(shared_data: Path, capsys):
    assert main.status(["info", str(shared_data / "aces.log.gz")]) == 0
    assert "440 in 1318.1 s, 0.3 a second, mostly 0.5" in capsys.readouterr().out


def test_the_folder_of_a_converted_recording_is_made(log: Path, tmp_path: Path, capsys):
    to = tmp_path / "logs" / "drive.npz"
    assert main.status(["convert", str(log), str(to)]) == 0
    assert to.is_file()
    assert main.status(["convert", str(log), str(log / "drive.npz")]) == 2
    assert "it is a file" in capsys.readouterr().err
