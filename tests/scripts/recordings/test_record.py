# pyright: reportMissingImports=false
import json
from pathlib import Path

import numpy as np
import pytest
from dynslam_cli import main
from dynslam_cli.main import status
from dynslam_cli.recordings.record import numbers
from rosbags.highlevel import AnyReader

from agents import record_corridor
from slam.errors import InputError
from slam.io.carmen.reader import read_carmen
from slam.io.door_runs import read_door_runs
from slam.io.episode_file import load_episode
from slam.io.tum import read_tum


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    out = tmp_path_factory.mktemp("episodes")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("DYNSLAM_CACHE", str(tmp_path_factory.mktemp("cache")))
        assert main.status(["record", "DoorCorridor-v0", "--seeds", "5,7", "--out", str(out)]) == 0
    return out


def test_every_seed_is_there_in_every_format(recorded):
    for seed in (5, 7):
        names = {path.name for path in recorded.glob(f"DoorCorridor-v0-{seed}*")}
        stem = f"DoorCorridor-v0-{seed}"
        assert names == {stem, f"{stem}.npz", f"{stem}.log.gz", f"{stem}.tum"}


def test_a_world_of_another_package(tmp_path, own_ids, monkeypatch):
    monkeypatch.setenv("DYNSLAM_CACHE", str(tmp_path / "cache"))
    words = ["own_ids:OwnWorld-v0", "--seeds", "3", "--formats", "npz", "--out", str(tmp_path)]
    assert main.status(["record", *words]) == 0
    episode = load_episode(tmp_path / "OwnWorld-v0-3.npz")
    assert episode.truth is not None
    assert np.ptp(episode.truth.walls[:, 0]) == pytest.approx(7.0, abs=1.0)


def test_a_laser_and_a_robot_by_name(tmp_path, monkeypatch):
    monkeypatch.setenv("DYNSLAM_CACHE", str(tmp_path / "cache"))
    words = ["--laser", "RPLIDAR-A2", "--robot", "Pioneer-3DX", "--formats", "npz"]
    assert main.status(["record", "DoorCorridor-v0", *words, "--out", str(tmp_path)]) == 0
    episode = load_episode(tmp_path / "DoorCorridor-v0-5000.npz")
    assert episode.meta["config"]["robot"]["radius"] == 0.25
    assert {len(scan.ranges) for scan in episode.scans} == {800}
    assert episode.scans[0].mount.x == 0.018


@pytest.mark.parametrize("words", [["--laser", "SICK"], ["--robot", "Pioneer"]])
def test_an_unknown_laser_or_robot_is_refused(words, tmp_path, capsys):
    assert main.status(["record", "DoorCorridor-v0", *words, "--out", str(tmp_path)]) == 2
    assert f"{words[0][2:]} must be one of" in capsys.readouterr().err


def test_all_formats_tell_of_one_drive(recorded):
    stem = recorded / "DoorCorridor-v0-5"
    whole = load_episode(stem.with_suffix(".npz"))
    expected = record_corridor(5)
    assert whole.truth is not None
    assert expected.truth is not None
    assert (whole.truth.poses == expected.truth.poses).all()
    log, _ = read_carmen(stem.with_suffix(".log.gz"))
    assert log.times == pytest.approx(whole.times, abs=1e-6)
    assert np.array(log.displacements()) == pytest.approx(np.array(whole.displacements()), abs=2e-5)
    truth = read_tum(stem.with_suffix(".tum"))
    assert truth.poses == pytest.approx(whole.truth.poses, abs=1e-8)


def test_a_bag_holds_what_ros_expects(recorded):
    whole = load_episode(recorded / "DoorCorridor-v0-5.npz")
    assert whole.truth is not None
    with AnyReader([recorded / "DoorCorridor-v0-5"]) as bag:
        latched = {c.topic for c in bag.connections if getattr(c.ext, "offered_qos_profiles", None)}
        messages = {}
        for connection, stamp, raw in bag.messages():
            message = bag.deserialize(raw, connection.msgtype)
            messages.setdefault(connection.topic, []).append((stamp, message))
    assert {topic: len(found) for topic, found in messages.items()} == {
        "/scan": len(whole.scans), "/odom": len(whole.scans), "/tf": len(whole.scans),
        "/ground_truth": len(whole.scans), "/tf_static": 1,
    }  # fmt: skip
    for k, (stamp, scan) in enumerate(messages["/scan"]):
        own = whole.scans[k]
        assert stamp == scan.header.stamp.sec * 10**9 + scan.header.stamp.nanosec
        assert stamp == pytest.approx(1e9 * own.time, abs=1)
        assert scan.ranges.dtype == np.float32
        assert scan.ranges[own.hit] == pytest.approx(own.ranges[own.hit], rel=1e-6)
        assert np.isinf(scan.ranges[own.no_echo]).all()
        angles = scan.angle_min + scan.angle_increment * np.arange(len(scan.ranges))
        assert angles == pytest.approx(own.angles, abs=1e-5)
    for topic, poses in (("/odom", whole.odometry.poses), ("/ground_truth", whole.truth.poses)):
        for k in (0, 100, -1):
            pose = messages[topic][k][1].pose.pose
            turn = 2 * np.arctan2(pose.orientation.z, pose.orientation.w)
            assert (pose.position.x, pose.position.y) == pytest.approx(tuple(poses[k, :2]))
            assert np.cos(turn - poses[k, 2]) == pytest.approx(1.0)
    assert latched == {"/tf_static"}  # tf2 listens to nothing else
    mounting = messages["/tf_static"][0][1].transforms[0]
    assert (mounting.header.frame_id, mounting.child_frame_id) == ("base_link", "laser")
    moving = messages["/tf"][-1][1].transforms[0]
    assert (moving.header.frame_id, moving.child_frame_id) == ("odom", "base_link")
    assert moving.transform.translation.x == messages["/odom"][-1][1].pose.pose.position.x


def test_a_bag_is_not_overwritten(recorded, capsys):
    arguments = ["record", "DoorCorridor-v0", "--seeds", "5", "--formats", "mcap"]
    arguments += ["--out", str(recorded), "--doors", "static"]
    assert main.status(arguments) == 2
    assert "is there already" in capsys.readouterr().err


def test_after_a_kill_the_same_command_goes_on(tmp_path, monkeypatch):
    """The first bag is there, the second is not."""
    monkeypatch.setenv("DYNSLAM_CACHE", str(tmp_path / "cache"))
    out = tmp_path / "out"
    arguments = ["record", "DoorCorridor-v0", "--formats", "mcap", "--out", str(out)]
    assert main.status([*arguments, "--seeds", "5"]) == 0
    (bag,) = out.iterdir()
    before = {one.name: one.read_bytes() for one in bag.iterdir()}
    assert main.status([*arguments, "--seeds", "5,7"]) == 0
    assert {one.name: one.read_bytes() for one in bag.iterdir()} == before
    assert len(list(out.iterdir())) == 2


def test_what_is_recorded_can_be_mapped_and_scored(recorded, tmp_path, capsys):
    stem = recorded / "DoorCorridor-v0-7"
    log, npz = f"{stem}.log.gz", f"{stem}.npz"
    assert main.status(["run", log, "--slam", "static-ml", "--out", str(tmp_path)]) == 0
    capsys.readouterr()
    files = [npz, str(tmp_path / "trajectory.tum"), str(tmp_path / "map.yaml")]
    assert main.status(["score", *files, "--json"]) == 0
    scores = json.loads(capsys.readouterr().out)
    whole = load_episode(npz)
    assert scores["scans"] == len(whole.scans)
    assert 0.002 < scores["ate"] < 0.05
    assert scores["f1_5cm"] > 0.8
    assert main.status(["score", *files[:2]]) == 0
    told = capsys.readouterr().out
    assert f"ATE: {1e3 * scores['ate']:.1f} mm" in told
    assert "F1" not in told  # there was no map


@pytest.mark.parametrize(
    ("text", "expected"),
    [("5000", [5000]), ("1-3", [1, 2, 3]), ("7,1-2,7", [7, 1, 2]), (" 4 , 5-5 ", [4, 5])],
)
def test_seeds_are_numbers_and_ranges(text, expected):
    assert numbers(text) == expected


@pytest.mark.parametrize("text", ["", "a", "3-1", "1,,2", "-5", "1-", "1-2-3"])
def test_other_seeds_are_refused(text):
    with pytest.raises(InputError, match="seeds must be like"):
        numbers(text)


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["Door-v0"], "unknown environment 'Door-v0'; did you mean Door"),
        (["DoorCorridor-v0", "--formats", "bag"], "unknown format 'bag'; known: all, npz"),
        (["DoorCorridor-v0", "--doors", "ajar"], "doors must be one of 'moving', 'static'"),
    ],
)
def test_mistakes_are_told(arguments, told, capsys, tmp_path):
    assert main.status(["record", *arguments, "--out", str(tmp_path)]) == 2
    assert told in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


@pytest.fixture
def several(recorded, tmp_path):
    """Two episodes, and for each the true trajectory under three names."""
    for stem in ("DoorCorridor-v0-5", "DoorCorridor-v0-7"):
        (tmp_path / stem).mkdir()
        for name in (f"{stem}.tum", f"{stem}-mine.tum", f"{stem}/trajectory.tum"):
            (tmp_path / name).write_bytes((recorded / f"{stem}.tum").read_bytes())
    return tmp_path


def test_many_trajectories_find_their_episodes_by_name_and_share_a_table_of_80_columns(
    recorded, several, capsys, monkeypatch
):
    monkeypatch.chdir(several)
    monkeypatch.setenv("COLUMNS", "80")
    long = "DoorCorridor-v0-7-of-a-system-with-a-name-that-is-longer-than-its-column-is-wide.tum"
    (several / "DoorCorridor-v0-7-mine.tum").rename(long)
    files = ["DoorCorridor-v0-5.tum", long, "DoorCorridor-v0-7/trajectory.tum"]
    assert main.status(["score", str(recorded), *files]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= 80
    assert sum("0.0" in line for line in lines) == 3
    assert main.status(["score", str(recorded), *files, "--json"]) == 0
    scores = json.loads(capsys.readouterr().out)
    assert [one["trajectory"] for one in scores] == files
    assert all(one["ate"] < 1e-6 for one in scores)
    assert scores[0]["of"] == len(load_episode(recorded / "DoorCorridor-v0-5.npz").scans)


def test_stamps_of_another_clock_are_moved_by_an_offset(recorded, several, capsys):
    late = several / "late.tum"
    lines = (several / "DoorCorridor-v0-7.tum").read_text().splitlines()[1:]
    moved = [f"{float(line.split()[0]) + 1e6:.6f} {line.split(' ', 1)[1]}\n" for line in lines]
    late.write_text("".join(moved))
    episode = str(recorded / "DoorCorridor-v0-7.npz")
    assert main.status(["score", episode, str(late)]) == 2
    assert main.status(["score", episode, str(late), "--offset=-1e6", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["ate"] < 1e-6


@pytest.mark.parametrize(
    ("names", "told"),
    [
        (("map.yaml",), "a map follows its trajectory"),
        (("DoorCorridor-v0-5.tum", "a.yaml", "b.yaml"), "a map follows its trajectory"),
        ((), "no trajectory named"),
        (("DoorCorridor-v0-50.tum",), "no episode in"),
    ],
)
def test_files_that_belong_together_in_no_way_are_told(recorded, several, capsys, names, told):
    files = [str(several / name) for name in names]
    assert main.status(["score", str(recorded), *files]) == 2
    assert told in capsys.readouterr().err


def test_a_campaign_is_written_with_its_building_and_doors(tmp_path: Path):
    options = "DoorOffice-v0 --days 2 --visits 1 --minutes 0.2 --seeds 3 --formats npz --out"
    assert status(["record", *options.split(), str(tmp_path)]) == 0
    names = sorted(path.name for path in tmp_path.iterdir())
    doors = [f"DoorOffice-v0-3-door{k}.csv" for k in range(5)]
    visits = [f"DoorOffice-v0-3-day0{day}-0.npz" for day in (0, 1)]
    assert names == sorted(["DoorOffice-v0-3-building.json", *doors, *visits])
    first, second = (load_episode(tmp_path / name) for name in visits)
    assert second.times[0] - first.times[-1] > 3600.0
    history = read_door_runs(tmp_path / doors[0])
    assert history.end[-1] - history.begin[0] == 2 * 86400.0


def test_campaigns_refuse_what_they_cannot_take(tmp_path: Path, capsys):
    wrong = ["record", "DoorOffice-v0", "--out", str(tmp_path)]
    assert status([*wrong, "--days", "2", "--doors", "static"]) == 2
    assert status([*wrong, "--history", "door.csv"]) == 2
    assert status([*wrong, "--days", "2", "--history", str(tmp_path / "none.csv")]) == 2
    told = capsys.readouterr().err.splitlines()
    assert "no --doors" in told[0]
    assert "--days" in told[1]
    assert "none.csv" in told[2]
