import math
from pathlib import Path

import numpy as np
import pytest

from slam.errors import InputError
from slam.geometry import Pose2, compose
from slam.io.bags import read_bag
from slam.io.loaded_recording import SourceSelection
from slam.preprocessing.deskewing import deskewed
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


@pytest.mark.parametrize("fan", [(-0.5, 0.5), (0.5, -0.5), (0.0, 0.25), (-math.pi, math.pi)])
def test_angles_are_those_of_the_message_either_way_round(tmp_path: Path, fan) -> None:
    (one,) = read(tmp_path, [scan(1.0, fan=fan)]).episode.scans
    np.testing.assert_allclose(one.angles, fan[0] + fan[1] * np.arange(3), atol=1e-6)
    np.testing.assert_allclose(one.ranges, [1, 2, 3])


@pytest.mark.parametrize("beams", [1, 2, 360, 4000])
def test_any_number_of_beams_of_a_full_turn(tmp_path: Path, beams: int) -> None:
    step = math.tau / beams
    (one,) = read(tmp_path, [scan(1.0, [2.0] * beams, (-math.pi, step))]).episode.scans
    assert len(one.ranges) == beams
    np.testing.assert_allclose(one.angles, -math.pi + step * np.arange(beams), atol=2e-3)


def test_one_beam_without_a_step(tmp_path: Path) -> None:
    (one,) = read(tmp_path, [scan(1.0, [2.0], (0.25, 0.0))]).episode.scans
    assert one.angles.tolist() == [0.25]


def test_where_the_step_is_missing_first_and_last_count(tmp_path: Path) -> None:
    (one,) = read(tmp_path, [scan(1.0, fan=(-1.0, 0.0), last=1.0)]).episode.scans
    assert one.angles.tolist() == [-1, 0, 1]


@pytest.mark.parametrize(
    ("fan", "last"), [((NAN, 0.1), 1.0), ((0.0, NAN), NAN), ((INF, 0.1), 1.0), ((0.0, 9.0), 90.0)]
)
def test_a_scan_without_angles_is_left_out(tmp_path: Path, fan, last: float) -> None:
    log = read(tmp_path, [scan(1.0), scan(2.0, fan=fan, last=last), scan(3.0, [])])
    assert len(log.episode.scans) == 1
    assert "without beams or without angles, left out: 2 times" in told(log)


def test_beams_may_change_from_scan_to_scan(tmp_path: Path) -> None:
    scans = read(tmp_path, [scan(k, [1.0] * (k + 1)) for k in range(1, 5)]).episode.scans
    assert [len(one.ranges) for one in scans] == [2, 3, 4, 5]


def test_what_a_reading_means(tmp_path: Path) -> None:
    ranges = [INF, -INF, NAN, 0.0, -1.0, 0.05, 0.5, 9.99, 10.0, 11.0]
    (one,) = read(tmp_path, [scan(1.0, ranges, (-1.0, 0.1))]).episode.scans
    expected = [INF, NAN, NAN, NAN, NAN, NAN, 0.5, 9.99, INF, INF]
    np.testing.assert_allclose(one.ranges, expected, rtol=1e-6)
    assert one.hit.sum() == 2


def test_without_a_least_range_zero_is_no_reading(tmp_path: Path) -> None:
    (one,) = read(tmp_path, [scan(1.0, [0.0, 0.01, 1.0], reach=(0.0, 10.0))]).episode.scans
    assert math.isnan(one.ranges[0])
    assert one.hit.tolist() == [False, True, True]


@pytest.mark.parametrize("high", [0.0, INF, NAN, -1.0])
def test_a_reach_that_is_none_is_guessed(tmp_path: Path, high: float) -> None:
    log = read(tmp_path, [scan(1.0, reach=(0.1, high))])
    assert log.episode.scans[0].max_range == 81.83
    assert f"range_max {high:g} is no reach, 81.83 m assumed" in told(log)


@pytest.mark.parametrize("low", [NAN, INF, -1.0])
def test_a_least_range_that_is_none_is_zero(tmp_path: Path, low: float) -> None:
    assert read(tmp_path, [scan(1.0, reach=(low, 10.0))]).episode.scans[0].min_range == 0


def rotated(axis: str, angle: float) -> tuple[tuple[float, ...], np.ndarray]:
    """A quaternion and its matrix, by the formula in the books."""
    half, c, s = angle / 2, math.cos(angle), math.sin(angle)
    k = "xyz".index(axis)
    quaternion = [0.0, 0.0, 0.0, math.cos(half)]
    quaternion[k] = math.sin(half)
    a, b = (k + 1) % 3, (k + 2) % 3
    matrix = np.eye(3)
    matrix[a, a], matrix[a, b], matrix[b, a], matrix[b, b] = c, -s, s, c
    return tuple(quaternion), matrix


@pytest.mark.parametrize(
    ("axis", "angle"),
    [("x", math.pi), ("y", math.pi), ("z", math.pi), ("z", 0.7), ("x", 0.0), ("z", -math.pi / 2)],
)
def test_end_points_of_a_laser_however_it_is_mounted(tmp_path: Path, axis, angle: float) -> None:
    turn, matrix = rotated(axis, angle)
    log = read(tmp_path, [static("laser", (0.3, -0.1, 0.5), turn), scan(1.0), odom(1.0), odom(2.0)])
    (one,) = log.episode.scans
    beams = np.array([-0.5, 0.0, 0.5])
    in_laser = np.array([1.0, 2.0, 3.0])[:, None] * np.column_stack(
        [np.cos(beams), np.sin(beams), np.zeros(3)]
    )
    np.testing.assert_allclose(one.points, (in_laser @ matrix.T)[:, :2] + (0.3, -0.1), atol=1e-6)
    assert log.warnings == ()


def test_upside_down_on_a_turned_bracket(tmp_path: Path) -> None:
    """Two frames: a bracket turned to the left, the laser hanging from it."""
    hanging, _ = rotated("x", math.pi)
    said = [
        static("bracket", (1.0, 0.0, 0.0), yawed(math.pi / 2)),
        static("laser", (0.5, 0.0, 0.0), hanging, parent="bracket"),
        scan(1.0, [2.0], (0.25, 0.0)), odom(1.0), odom(2.0),
    ]  # fmt: skip
    (one,) = read(tmp_path, said).episode.scans
    angle = math.pi / 2 - 0.25  # the beam 0.25 rad to the laser's left is to the right of ahead
    expected = [[1 + 2 * math.cos(angle), 0.5 + 2 * math.sin(angle)]]
    np.testing.assert_allclose(one.points, expected, atol=1e-6)


def test_a_tilted_laser_is_warned_of(tmp_path: Path) -> None:
    tilted, _ = rotated("y", math.radians(20))
    log = read(tmp_path, [static("laser", (0.0, 0.0, 0.0), tilted), *drive()[1:]])
    assert "the laser is tilted by 20 degrees" in told(log)


def test_a_laser_on_a_moving_joint_has_a_mount_at_each_scan(tmp_path: Path) -> None:
    said = drive()[1:] + [
        frame(1 + 0.1 * k, "base_link", "laser", (0.3, 0.0, 0.0), yawed(0.1 * k)) for k in range(11)
    ]
    scans = read(tmp_path, said).episode.scans
    for one in scans:
        assert one.mount == pytest.approx((0.3, 0.0, one.time - 1), abs=1e-6)


def test_of_several_lasers_one_must_be_chosen(tmp_path: Path) -> None:
    said = [scan(1.0), scan(1.0, [5.0], topic="/rear/scan", frame="rear")]
    with pytest.raises(
        InputError, match=r"several lasers, choose one \(--laser\): /rear/scan, /scan"
    ):
        read(tmp_path, said)
    path = tmp_path / "some.bag"
    assert read_bag(path, SourceSelection("/rear/scan")).episode.scans[0].ranges.tolist() == [5]
    with pytest.raises(InputError, match=r"some\.bag: no scans on '/front'; lasers: /rear/scan, /"):
        read_bag(path, SourceSelection("/front"))


def test_a_laser_with_several_echoes_is_refused(tmp_path: Path) -> None:
    def build(out):
        echo = typed(out, "sensor_msgs/msg/LaserEcho", echoes=np.ones(2, np.float32))
        return typed(
            out, "sensor_msgs/msg/MultiEchoLaserScan", header=out.make.header(1.0, "laser"),
            angle_min=0.0, angle_max=0.0, angle_increment=0.0, time_increment=0.0, scan_time=0.0,
            range_min=0.0, range_max=9.0, ranges=[echo], intensities=[],
        )  # fmt: skip

    with pytest.raises(InputError, match=r"/echoes is a MultiEchoLaserScan.*laser_proc"):
        read(tmp_path, [Said("/echoes", 1.0, build)])


def test_a_recording_without_a_laser_lists_its_topics(tmp_path: Path) -> None:
    message = r"no sensor_msgs/msg/LaserScan in it; topics: /odom, /tf_static"
    with pytest.raises(InputError, match=message):
        read(tmp_path, [odom(1.0), static("laser")])
    with pytest.raises(InputError, match="topics: none"):
        read_bag(write(tmp_path / "empty.bag", []))


def test_only_unusable_scans(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"some\.bag: no usable scan on /scan"):
        read(tmp_path, [scan(1.0, [])])


def test_topics_of_one_name_and_of_different_kinds(tmp_path: Path) -> None:
    """Two programs that disagree: the kind that most messages have counts."""
    said = [scan(1.0), scan(2.0), odom(1.5, topic="/scan")]
    path = tmp_path / "both.mcap"
    from rosbags import rosbag2
    from rosbags.rosbag2 import StoragePlugin

    from slam.io.bags.bag import ROS2
    from slam.io.bags.bag_writer import BagWriter

    with rosbag2.Writer(tmp_path / "both", version=8, storage_plugin=StoragePlugin.MCAP) as writer:
        out = BagWriter(writer)
        for topic, received, build in said:
            message = build(out)
            kind = message.__msgtype__
            known = {one.msgtype: one for one in writer.connections}
            connection = known.get(kind) or writer.add_connection(topic, kind, typestore=ROS2)
            writer.write(connection, round(received * 1e9), ROS2.serialize_cdr(message, kind))
    (tmp_path / "both" / "both.mcap").rename(path)
    assert len(read_bag(path).episode.scans) == 2


def test_a_sweep_on_the_move_is_put_where_the_beams_were(tmp_path: Path) -> None:
    """A laser at 1 rad a beam of 0.1 s, on a robot at 1 m/s towards a wall at x = 10."""
    poses = [odom(1 + 0.1 * k, 0.1 * k) for k in range(21)]
    ranges = [10 - 0.5 - 0.1 * k - 0.3 for k in range(3)]  # 0.5 m driven at the stamp, mount 0.3
    said = [static("laser", (0.3, 0.0, 0.0)), *poses, scan(1.5, ranges, (0.0, 1e-9), beam_time=0.1)]
    raw = read(tmp_path, said).episode
    (still,) = deskewed(raw).scans
    assert raw.scans[0].beam_time == pytest.approx(0.1)
    at_stamp = compose(np.array([0.5, 0, 0]), np.array(still.mount))
    np.testing.assert_allclose(at_stamp[0] + still.ranges, 10, atol=1e-5)
    assert (still.beam_time, still.mount) == (0.0, Pose2(0.3, 0.0, 0.0))


def test_a_sweep_beyond_its_reach_stays_no_echo(tmp_path: Path) -> None:
    from slam.episode import Episode
    from slam.scan import Scan
    from slam.trajectory import Trajectory

    one = Scan(np.array([10.0, 4.0, 10.0]), np.zeros(3), 10.0, time=0.0, beam_time=0.1)
    odometry = Trajectory(np.array([0.0, 1.0]), np.array([[0.0, 0, 0], [-5.0, 0, 0]]))
    (still,) = deskewed(Episode((one,), odometry)).scans
    assert still.no_echo.tolist() == [True, False, True]
