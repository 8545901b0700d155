import math
from pathlib import Path

import numpy as np
import pytest

from slam.errors import InputError
from slam.geometry import Pose2
from slam.io.bags import read_bag, read_reference
from slam.io.loaded_recording import SourceSelection
from tests.slam.io.bags.recordings import (
    Said,
    drive,
    frame,
    odom,
    read,
    scan,
    static,
    told,
    typed,
    write,
    yawed,
)

NAN, INF = math.nan, math.inf


def tf_drive(parent: str = "odom", child: str = "base_link") -> list[Said]:
    """The same drive told by /tf alone."""
    moving = [frame(1 + 0.1 * k, parent, child, (0.1 * k, 0.0, 0.0)) for k in range(11)]
    return [*moving, *(one for one in drive() if one.topic != "/odom")]


def test_a_drive_as_it_was(tmp_path: Path) -> None:
    log = read(tmp_path, drive())
    drove = log.episode
    assert log.warnings == ()
    np.testing.assert_allclose(drove.times, 1.05 + 0.2 * np.arange(5))
    np.testing.assert_allclose(drove.odometry.poses[:, 0], 0.1 * np.arange(11))
    assert {one.mount for one in drove.scans} == {Pose2(0.3, 0.0, 0.0)}
    assert dict(drove.meta) == {"source": "some.bag", "laser": "/scan", "odometry": "/odom"}
    assert drove.displacements()[1].x == pytest.approx(0.2)


@pytest.mark.parametrize("parent", ["odom", "/odom", "wheel_odom", "odom_combined"])
def test_odometry_out_of_tf(tmp_path: Path, parent: str) -> None:
    drove = read(tmp_path, tf_drive(parent)).episode
    np.testing.assert_allclose(drove.odometry.poses[:, 0], 0.1 * np.arange(11))
    assert drove.meta["odometry"] == f"/tf: base_link in {parent.strip('/')}"
    assert drove.scans[0].mount == Pose2(0.3, 0.0, 0.0)


def test_slashes_before_frames_are_of_old_recordings(tmp_path: Path) -> None:
    said = [
        static("/laser", (0.3, 0.0, 0.0), parent="/base_link"),
        *(odom(1 + k, k, child="/base_link") for k in range(3)),
        scan(2.0, frame="laser"), scan(3.0, frame="/laser"),
    ]  # fmt: skip
    log = read(tmp_path, said)
    assert [one.mount for one in log.episode.scans] == [Pose2(0.3, 0.0, 0.0)] * 2
    assert log.warnings == ()


def test_the_topic_goes_before_tf_and_either_can_be_chosen(tmp_path: Path) -> None:
    moving = [frame(1 + k, "odom", "base_link", (5.0 * k, 0.0, 0.0)) for k in range(3)]
    path = write(tmp_path / "both.bag", [*drive(), *moving])
    assert read_bag(path).episode.meta["odometry"] == "/odom"
    chosen = read_bag(path, SourceSelection(odometry="odom")).episode
    assert chosen.meta["odometry"] == "/tf: base_link in odom"
    assert chosen.odometry.poses[:, 0].tolist() == [0, 5, 10]
    none = read_bag(path, SourceSelection(odometry="none")).episode
    assert not none.has_odometry
    assert not none.odometry.poses.any()
    assert none.scans[0].mount == Pose2(0.3, 0.0, 0.0)
    with pytest.raises(InputError, match=r"both\.bag: no odometry 'gps': neither a topic of nav_m"):
        read_bag(path, SourceSelection(odometry="gps"))


def test_several_odometries_are_listed_but_for_references(tmp_path: Path) -> None:
    others = [odom(1.0 + k, 7.0 * k, topic=name) for name in ("/ekf", "/wheels") for k in (0, 1)]
    said = [scan(1.0), *others, odom(1.0, topic="/ground_truth"), odom(1.0, topic="/base_pose_gt")]
    with pytest.raises(
        InputError, match=r"several odometries, choose one \(--odometry\): /ekf, /wheels$"
    ):
        read(tmp_path, said)
    path = tmp_path / "some.bag"
    assert read_bag(path, SourceSelection(odometry="/wheels")).episode.odometry.poses[1, 0] == 7
    assert read_bag(path, SourceSelection(odometry="/ground_truth")).episode.meta["odometry"] != ""
    assert len(read_reference(path, "/base_pose_gt")) == 1


def test_a_standard_name_decides(tmp_path: Path) -> None:
    assert read(tmp_path, [*drive(), odom(1.0, topic="/ekf")]).episode.meta["odometry"] == "/odom"


def test_no_odometry_at_all(tmp_path: Path) -> None:
    log = read(tmp_path, [scan(1.0), scan(2.0)])
    assert not log.episode.has_odometry
    assert "no odometry in it: the laser alone tells how the robot moved" in told(log)


def test_a_mount_that_nobody_tells_and_one_that_is_given(tmp_path: Path) -> None:
    said = drive()[1:]
    log = read(tmp_path, said)
    assert log.episode.scans[0].mount == Pose2()
    assert "where the laser (laser) stands on the robot (base_link): taken to be" in told(log)
    given = Pose2(0.1, 0.2, 0.3)
    (tmp_path / "some.bag").unlink()
    log = read(tmp_path, said, SourceSelection(mount=given))
    assert {one.mount for one in log.episode.scans} == {given}
    assert log.warnings == ()


def test_turned_poses_and_quaternions_that_are_not_of_length_one(tmp_path: Path) -> None:
    half = tuple(0.7 * value for value in yawed(2.0))
    log = read(tmp_path, [scan(1.5), odom(1.0, turn=half), odom(2.0, turn=yawed(-1.0))])
    np.testing.assert_allclose(log.episode.odometry.poses[:, 2], [2, -1], atol=1e-9)


@pytest.mark.parametrize(
    "bad",
    [
        odom(1.5, NAN), odom(1.5, INF), odom(1.5, 1e300), odom(1.5, turn=(0.0,) * 4),
        odom(1.5, turn=(NAN, 0.0, 0.0, 1.0)), odom(1.5, turn=(0.0, 0.0, 1e200, 1e200)),
    ],
)  # fmt: skip
def test_a_pose_that_is_none_is_left_out(tmp_path: Path, bad: Said) -> None:
    log = read(tmp_path, [scan(1.2), odom(1.0), bad, odom(2.0, 1.0)])
    assert log.episode.odometry.times.tolist() == [1, 2]
    assert "odometry that is no pose, left out: once" in told(log)


@pytest.mark.parametrize(
    "bad",
    [
        static("laser", (NAN, 0.0, 0.0)),
        static("laser", (0.0, 0.0, 0.0), (0.0,) * 4),
        static("laser", (0.0, 1e300, 0.0)),
        static("laser", parent="laser"),
        static("base_link", parent="laser"),
    ],
)
def test_a_transform_that_is_none_is_left_out(tmp_path: Path, bad: Said) -> None:
    log = read(tmp_path, [*drive(), bad._replace(received=1.5)])
    assert log.episode.scans[0].mount == Pose2(0.3, 0.0, 0.0)
    assert "that is none, left out: once" in told(log)


def test_frames_in_a_ring_and_frames_without_end(tmp_path: Path) -> None:
    ring = [frame(1.0, f"f{k}", f"f{(k + 1) % 5}") for k in range(5)]
    deep = [frame(1.0, f"d{k}", f"d{k + 1}") for k in range(300)]
    log = read(tmp_path, [*drive(), *ring, *deep])
    assert log.episode.scans[0].mount == Pose2(0.3, 0.0, 0.0)
    assert len(log.warnings) <= 60


def test_stamps_that_are_zero_are_those_of_recording(tmp_path: Path) -> None:
    said = [scan(2.0 + k, stamp=0.0) for k in range(3)]
    said += [odom(1.0 + k, k, stamp=0.0) for k in range(5)]
    drove = read(tmp_path, said).episode
    assert drove.times.tolist() == [2, 3, 4]
    assert drove.odometry.times.tolist() == [1, 2, 3, 4, 5]


def test_stamps_of_different_clocks(tmp_path: Path) -> None:
    """The laser counts from its start, the robot from 1970."""
    said = [scan(2.0 + k, stamp=0.5 + k) for k in range(3)]
    said += [odom(1.0 + k, k, stamp=1e9 + k) for k in range(5)]
    log = read(tmp_path, said)
    assert log.episode.times.tolist() == [2, 3, 4]
    assert log.episode.displacements()[1].x == pytest.approx(1)
    assert "of different clocks, times of recording used" in told(log)


@pytest.mark.parametrize("who", ["scan", "odom"])
def test_a_clock_that_runs_back(tmp_path: Path, who: str) -> None:
    set_back = {name: (-30.0 if name == who else 0.0) for name in ("scan", "odom")}
    said = [scan(50 + k, stamp=50 + k + (k > 2) * set_back["scan"]) for k in range(6)]
    said += [odom(50 + k, k, stamp=50 + k + (k > 2) * set_back["odom"]) for k in range(6)]
    log = read(tmp_path, said)
    assert log.episode.times.tolist() == [50, 51, 52, 53, 54, 55]
    assert "stamps run back, times of recording used" in told(log)


def test_messages_that_arrive_late_are_put_in_order(tmp_path: Path) -> None:
    said = [odom(1 + k, k) for k in range(5)]
    said += [scan(2.0, [2.0], stamp=2.5), scan(2.1, [1.0], stamp=2.2), scan(3.0, [3.0])]
    log = read(tmp_path, said)
    assert [one.ranges[0] for one in log.episode.scans] == [1, 2, 3]
    assert "two scans" not in told(log)


def test_duplicates_count_once(tmp_path: Path) -> None:
    said = [*drive(), odom(1.25, 9.0, stamp=1.2), scan(1.3, [5.0], stamp=1.25)]
    log = read(tmp_path, said)
    assert len(log.episode.scans) == 5
    assert len(log.episode.odometry) == 11
    assert "two scans of the same time, the second left out: once" in told(log)


def test_scans_without_odometry_around_are_left_out(tmp_path: Path) -> None:
    said = [scan(0.5), scan(0.8), scan(1.5), scan(2.2), scan(2.6), odom(1.0), odom(2.0, 1.0)]
    log = read(tmp_path, said)
    np.testing.assert_allclose(log.episode.times, [0.8, 1.5, 2.2])
    assert "before or after all odometry, left out: 2 times" in told(log)


def test_a_scan_in_a_gap_of_the_odometry_lies_between(tmp_path: Path) -> None:
    drove = read(tmp_path, [scan(5.0), odom(1.0), odom(2.0), odom(8.0, 6.0)]).episode
    assert drove.odometry.at(drove.times)[0, 0] == pytest.approx(3.0)


def test_reference_of_any_kind_of_pose(tmp_path: Path) -> None:
    def stamped(out):
        pose = out.make.pose(Pose2(1.0, 2.0, 0.5))
        return typed(
            out, "geometry_msgs/msg/PoseStamped", header=out.make.header(1.0, "map"), pose=pose
        )

    path = write(tmp_path / "some.bag", [Said("/mocap", 1.0, stamped), scan(1.0)])
    np.testing.assert_allclose(read_reference(path, "/mocap").poses, [[1, 2, 0.5]])
    with pytest.raises(InputError, match=r"no topic '/gps'; there are /mocap, /scan"):
        read_reference(path, "/gps")
    with pytest.raises(InputError, match="/scan is a sensor_msgs/msg/LaserScan and tells no pose"):
        read_reference(path, "/scan")
