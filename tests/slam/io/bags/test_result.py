import dataclasses
from collections import defaultdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from agents import record_corridor
from slam.episode import Episode
from slam.errors import InputError
from slam.geometry import Array, Pose2, compose
from slam.grid import GridSpec, OccupancyGrid
from slam.io.bags import read_bag, write_result
from slam.io.bags.bag import open_bag
from slam.io.bags.result import MAX_PATH_POSES
from slam.io.bags.transforms import Transforms, seen_from_above
from slam.io.warnings import WarningCounter
from slam.maps.snapshot import MapSnapshot
from slam.trajectory import Trajectory

SCANS = 30
MOUNT = Pose2(0.2, -0.1, 0.3)
OFF = Pose2(3.0, -2.0, 1.0)  # what the SLAM makes of the odometry, for a test


@pytest.fixture(scope="module")
def episode() -> Episode:
    drive = record_corridor(3, "moving")
    scans = tuple(dataclasses.replace(scan, mount=MOUNT) for scan in drive.scans[:SCANS])
    return Episode(scans, drive.odometry)


@pytest.fixture(scope="module")
def online(episode: Episode) -> Array:
    return compose(np.array(OFF), episode.odometry.at(episode.times))


def stages(online: Array, *scans: int) -> list[MapSnapshot]:
    spec = GridSpec(0.05, -64, 128, 64, 128)
    grid = OccupancyGrid(spec, np.full(spec.shape, 0.25), np.ones(spec.shape, np.bool_))
    grid.observed[0, 5] = False
    return [MapSnapshot.of(online[: scan + 1], grid) for scan in scans]


def messages(path: Path) -> dict[str, list[Any]]:
    found = defaultdict(list)
    with open_bag(path, WarningCounter("message")) as bag:
        for name, _, message in bag.messages(list(bag.topics)):
            found[name].append(message)
    return found


def frames(found: dict[str, list[Any]]) -> Transforms:
    tree = Transforms()
    for told in (*found["/tf"], *found["/tf_static"]):
        for one in told.transforms:
            at, q, stamp = one.transform.translation, one.transform.rotation, one.header.stamp
            row = (stamp.sec + 1e-9 * stamp.nanosec, at.x, at.y, at.z, q.x, q.y, q.z, q.w)
            assert tree.add(one.header.frame_id, one.child_frame_id, row)
    return tree


@pytest.mark.parametrize("name", ["a.mcap", "a.bag", "a.db3", "a"])
def test_our_own_reader_finds_the_same_drive(
    tmp_path: Path, episode: Episode, online: Array, name: str
) -> None:
    write_result(tmp_path / name, episode, online, stages(online, 0, 29))
    back, warnings = read_bag(tmp_path / name)
    assert not warnings
    assert np.allclose(back.times, episode.times)
    assert back.scans[3].mount == pytest.approx(MOUNT)
    assert np.allclose(back.scans[3].points, episode.scans[3].points, atol=1e-5)
    assert np.allclose(back.odometry.at(back.times), episode.odometry.at(episode.times))


def test_the_frames_lead_from_the_map_to_the_laser(
    tmp_path: Path, episode: Episode, online: Array
) -> None:
    write_result(tmp_path / "a.mcap", episode, online, stages(online, 0, 29))
    tree = frames(messages(tmp_path / "a.mcap"))
    assert tree.ancestors("laser") == ["laser", "base_link", "odom", "map"]
    lasers = seen_from_above(*tree.at("map", "laser", episode.times))
    assert np.allclose(lasers, compose(online, np.array(MOUNT)), atol=1e-6)


def test_no_transform_is_told_twice(tmp_path: Path, episode: Episode, online: Array) -> None:
    write_result(tmp_path / "a.mcap", episode, online, stages(online, 29))
    told = [
        (one.child_frame_id, one.header.stamp.sec, one.header.stamp.nanosec)
        for message in messages(tmp_path / "a.mcap")["/tf"]
        for one in message.transforms
    ]
    assert len(told) == len(set(told))


def test_maps_are_as_they_were_and_lie_in_the_map_frame(
    tmp_path: Path, episode: Episode, online: Array
) -> None:
    write_result(tmp_path / "a.mcap", episode, online, stages(online, 0, 10, 29))
    found = messages(tmp_path / "a.mcap")
    assert len(found["/map"]) == len(found["/path"]) == 3
    grid = found["/map"][-1]
    assert grid.header.frame_id == "map"
    assert (grid.info.width, grid.info.height) == (128, 64)
    assert grid.info.origin.position.x == pytest.approx(128 * 0.05)
    assert grid.info.origin.position.y == pytest.approx(-64 * 0.05)
    data = grid.data.reshape(64, 128)
    assert data[0, 5] == -1
    assert data[1, 5] == 25


def test_paths_on_the_way_are_thinned_and_the_last_is_whole(tmp_path: Path) -> None:
    count = 2 * MAX_PATH_POSES
    drive = record_corridor(3, "moving")
    one = drive.scans[0]
    scans = tuple(dataclasses.replace(one, time=0.1 * k) for k in range(count))
    poses = np.column_stack([np.arange(float(count)), np.zeros((count, 2))])
    long = Episode(scans, Trajectory(np.array([scan.time for scan in scans]), poses))
    write_result(tmp_path / "a.mcap", long, poses, stages(poses, count - 5, count - 1))
    first, last = messages(tmp_path / "a.mcap")["/path"]
    assert len(first.poses) == MAX_PATH_POSES
    assert first.poses[0].pose.position.x == 0.0
    assert first.poses[-1].pose.position.x == count - 5
    assert [pose.pose.position.x for pose in last.poses] == list(range(count))


def test_without_odometry_the_map_holds_the_robot(
    tmp_path: Path, episode: Episode, online: Array
) -> None:
    still = Trajectory(episode.times, np.zeros((SCANS, 3)))
    lone = Episode(episode.scans, still, meta={"odometry": ""})
    write_result(tmp_path / "a.mcap", lone, online, stages(online, 29))
    found = messages(tmp_path / "a.mcap")
    assert "/odom" not in found
    assert frames(found).ancestors("laser") == ["laser", "base_link", "map"]
    assert not read_bag(tmp_path / "a.mcap").episode.has_odometry


def test_uneven_beams_become_points(tmp_path: Path, episode: Episode, online: Array) -> None:
    scans = [
        dataclasses.replace(scan, angles=np.sort(np.sin(scan.angles))) for scan in episode.scans
    ]
    uneven = dataclasses.replace(episode, scans=tuple(scans))
    write_result(tmp_path / "a.mcap", uneven, online, stages(online, 29))
    found = messages(tmp_path / "a.mcap")
    assert "/scan" not in found
    cloud, scan = found["/points"][7], scans[7]
    assert cloud.header.frame_id == "laser"
    points = np.frombuffer(cloud.data.tobytes(), np.float32).reshape(-1, 3)
    expected = Pose2(*MOUNT)
    turn = np.array([[np.cos(0.3), -np.sin(0.3)], [np.sin(0.3), np.cos(0.3)]])
    assert np.allclose(points[:, :2] @ turn.T + expected[:2], scan.points, atol=1e-5)
    assert (points[:, 2] == 0).all()


def test_a_laser_that_moves_on_the_robot(tmp_path: Path, episode: Episode, online: Array) -> None:
    mounts = [Pose2(0.1, 0.0, 0.01 * k) for k in range(SCANS)]
    scans = [
        dataclasses.replace(scan, mount=mount)
        for scan, mount in zip(episode.scans, mounts, strict=True)
    ]
    moving = dataclasses.replace(episode, scans=tuple(scans))
    write_result(tmp_path / "a.mcap", moving, online, stages(online, 29))
    back = read_bag(tmp_path / "a.mcap").episode
    assert np.allclose([scan.mount for scan in back.scans], mounts, atol=1e-6)


def test_a_run_that_was_cut_off_and_one_without_a_scan(
    tmp_path: Path, episode: Episode, online: Array
) -> None:
    write_result(tmp_path / "a.mcap", episode, online[:12], stages(online, 11))
    found = messages(tmp_path / "a.mcap")
    assert len(found["/scan"]) == 12
    assert len(found["/odom"]) <= 13
    with pytest.raises(InputError, match="nothing to write"):
        write_result(tmp_path / "b.mcap", episode, np.zeros((0, 3)), [])
    assert not (tmp_path / "b.mcap").exists()


@pytest.mark.parametrize("off", [-1e3, 1.7e10])
def test_times_that_ros_does_not_know_are_told(
    tmp_path: Path, episode: Episode, online: Array, off: float
) -> None:
    scans = tuple(dataclasses.replace(scan, time=scan.time + off) for scan in episode.scans)
    odometry = Trajectory(np.array([scan.time for scan in scans]), online)
    with pytest.raises(InputError, match="a bag needs times from 0"):
        write_result(tmp_path / "a.mcap", Episode(scans, odometry), online, stages(online, 29))
    assert not list(tmp_path.iterdir())
