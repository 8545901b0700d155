import gzip
import math
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slam.errors import InputError
from slam.geometry import Pose2
from slam.io.carmen.reader import LoadedRecording, read_carmen

BEAMS = 180
SPREAD = " ".join(f"{r:.2f}" for r in np.linspace(1, 4, 80)) + " "


def odom(time: float, x: float = 0.0) -> str:
    return f"ODOM {x} 0 0.1 0 0 0 {time:.6f} host {time:.6f}"


def flaser(time: float, x: float = 0.0, ranges: str = "2.5 " * BEAMS) -> str:
    return f"FLASER {len(ranges.split())} {ranges} 9 9 9 {x} 0 0.1 {time:.6f} host {time:.6f}"


def robotlaser(time: float, sensor: str = "0 -0.5 1.0 0.5 8 0.01 0") -> str:
    return (
        f"ROBOTLASER1 {sensor} 3 1 2 8 2 10 20 1.3 2 0.5 1 2 0.5 0 0 0 0 0 {time:.6f} host {time}"
    )


def read(tmp_path: Path, *lines: str) -> LoadedRecording:
    path = tmp_path / "some.log"
    path.write_text("\n".join(lines) + "\n")
    return read_carmen(path)


def told(log: LoadedRecording) -> dict[str, tuple[int, int]]:
    return {warned.kind: (warned.times, warned.line) for warned in log.warnings}


def test_flaser_and_odom_of_the_same_moment_are_one(tmp_path: Path) -> None:
    log = read(tmp_path, "# a log", odom(1), flaser(1), odom(2, 0.5), odom(3, 1.0), flaser(3, 1.0))
    assert log.warnings == ()
    assert log.episode.times.tolist() == [1, 3]
    assert log.episode.odometry.times.tolist() == [1, 2, 3]
    assert log.episode.odometry.poses[:, 0].tolist() == [0, 0.5, 1]
    scan = log.episode.scans[0]
    assert (scan.mount, scan.max_range) == (Pose2(), 81.83)
    assert scan.ranges.tolist() == [2.5] * BEAMS


@pytest.mark.parametrize(
    ("beams", "first", "last"),
    [
        (180, -90, 89),
        (181, -90, 90),
        (360, -90, 89.5),
        (361, -90, 90),
        (401, -50, 50),
        (5, -90, 90),
    ],
)
def test_angles_of_flaser(tmp_path: Path, beams: int, first: float, last: float) -> None:
    scan = read(tmp_path, flaser(1, ranges="1 " * beams)).episode.scans[0]
    assert np.degrees(scan.angles[[0, -1]]) == pytest.approx([first, last])
    assert np.allclose(np.diff(scan.angles), scan.angles[1] - scan.angles[0])


def test_parameters_of_the_laser(tmp_path: Path) -> None:
    scan = read(
        tmp_path,
        "PARAM robot_front_laser_max 8.0 host 0",
        "PARAM laser_front_laser_resolution 0.25 host 0",
        "PARAM robot_frontlaser_offset 0.3 host 0",
        "PARAM robot_frontlaser_side_offset -0.1 host 0",
        "PARAM robot_frontlaser_angular_offset 0.2 host 0",
        "PARAM base_type pioneer host 0",
        flaser(1, ranges="1 8 9 7.99 0"),
    ).episode.scans[0]
    assert scan.max_range == 8
    assert scan.ranges.tolist() == [1, math.inf, math.inf, 7.99, 0]
    assert np.degrees(scan.angles) == pytest.approx([-0.5, -0.25, 0, 0.25, 0.5])
    assert scan.mount == pytest.approx((0.3, -0.1, 0.2))


def test_robotlaser_brings_its_own_sensor(tmp_path: Path) -> None:
    log = read(tmp_path, robotlaser(5), flaser(6))
    assert told(log) == {"line of a second laser left out": (1, 2)}
    (scan,) = log.episode.scans
    assert scan.ranges.tolist() == [1, 2, math.inf]
    assert scan.angles.tolist() == [-0.5, 0, 0.5]
    assert scan.mount == pytest.approx(Pose2(1, 2, 0.5).between(Pose2(1.3, 2, 0.5)))
    assert log.episode.odometry.poses.tolist() == [[1, 2, 0.5]]


def test_a_robotlaser_whose_step_contradicts_its_view_spans_the_view(tmp_path: Path) -> None:
    scan = read(tmp_path, robotlaser(5, "0 -0.5 1.0 9.9 8 0.01 0")).episode.scans[0]
    assert scan.angles.tolist() == [-0.5, 0, 0.5]


@pytest.mark.parametrize(
    ("ranges", "limit"),
    [
        (SPREAD + "50 " * 20, 50.0),
        (SPREAD + "81.91 81.83 " * 20, 81.83),
        (SPREAD + "49.95 50 " * 20, 81.83),
        (SPREAD + "50", 81.83),
        (SPREAD + "4.5 5 5.5 6 " * 12, 81.83),  # coarse readings of a wall, no pile
        (SPREAD + "8.187 8.191 " * 20, 8.18),
    ],
)
def test_no_echo_is_where_the_largest_reading_piles_up(
    tmp_path: Path, ranges: str, limit: float
) -> None:
    scan = read(tmp_path, flaser(1, ranges=ranges)).episode.scans[0]
    assert scan.max_range == limit
    assert np.isinf(scan.ranges).tolist() == [float(word) >= limit for word in ranges.split()]


def test_garbled_lines_are_counted_and_the_rest_is_used(tmp_path: Path) -> None:
    log = read(
        tmp_path,
        flaser(1),
        flaser(2)[:200],
        flaser(3).replace("2.5", "2.5x", 1),
        "FLASER 1000000000 1 2 3",
        "FLASER -3 1 2 3",
        "ODOM nan 0 0 0 0 0 2.0 host 0",
        "ODOM 0 0 0",
        "FLOSER 3",
        "PARAM robot_front_laser_max wide",
        "RLASER 3",
        flaser(4),
    )
    assert log.episode.times.tolist() == [1, 4]
    assert told(log) == {"garbled line left out": (7, 2), "unknown message left out": (1, 8)}


def test_strange_ranges_and_beams_are_counted(tmp_path: Path) -> None:
    log = read(tmp_path, flaser(1), flaser(2, ranges="nan -1 3 inf"), flaser(3))
    assert told(log) == {
        "number of beams changed": (2, 2),
        "negative or NaN range taken for no reading": (1, 2),
    }
    scan = log.episode.scans[1]
    assert np.isnan(scan.ranges[:2]).all()
    assert scan.hit.tolist() == [False, False, True, False]
    assert scan.no_echo.tolist() == [False, False, False, True]


def test_time_that_runs_backwards_or_stands_still_is_moved(tmp_path: Path) -> None:
    times = [10.0, 11.0, 10.5, 10.5, 12.0, 9999.0, 13.0]
    log = read(tmp_path, *(flaser(time) for time in times))
    assert log.episode.times == pytest.approx(
        [10, 11, 11.000001, 11.000002, 12, 12.000001, 13], abs=1e-8
    )
    assert told(log) == {
        "time runs backwards, stamp moved forward": (2, 3),
        "time stamp leaps ahead, moved back": (1, 6),
    }
    still = read(tmp_path, flaser(1), flaser(1), flaser(2))
    assert told(still) == {"time stands still, stamp moved forward": (1, 2)}
    assert str(still.warnings[0]).endswith("moved forward: once, on line 2")


def test_no_two_scans_are_of_the_same_moment(tmp_path: Path) -> None:
    log = read(tmp_path, flaser(1), odom(1), flaser(1), flaser(2))
    assert log.episode.times.tolist() == pytest.approx([1, 1.000001, 2], abs=1e-9)
    assert told(log) == {"time stands still, stamp moved forward": (1, 3)}


@pytest.mark.parametrize("at", range(5))
@pytest.mark.parametrize("line", [odom, flaser])
def test_a_pose_that_leaps_away_and_back_is_left_out(
    tmp_path: Path, at: int, line: Callable[[float, float], str]
) -> None:
    lines = [flaser(k, k) for k in range(5)]
    lines[at] = line(at, 1e6)
    log = read(tmp_path, *lines)
    rest = [k for k in range(5) if k != at]
    assert told(log) == {"pose leaps away and back, line left out": (1, at + 1)}
    assert log.episode.times.tolist() == rest
    assert log.episode.odometry.poses[:, 0].tolist() == rest


def test_an_odometry_that_is_reset_and_a_fast_robot_are_kept(tmp_path: Path) -> None:
    places = [0, 40, 80, 120, 80, 40, 1000, 1001, 1002, 0, 1]
    log = read(tmp_path, *(flaser(k, x) for k, x in enumerate(places)))
    assert log.warnings == ()
    assert log.episode.odometry.poses[:, 0].tolist() == places


def test_each_leap_is_counted_and_a_lone_scan_that_leaps_is_no_log(tmp_path: Path) -> None:
    log = read(tmp_path, *(flaser(k, 1e6 * (k in (2, 4))) for k in range(7)))
    assert told(log) == {"pose leaps away and back, line left out": (2, 3)}
    assert len(log.episode.scans) == 5
    with pytest.raises(InputError, match=":3: a pose within reach"):
        read(tmp_path, odom(1), odom(2), flaser(3, 1e6))


def test_a_real_log_with_one_garbled_pose(shared_data: Path, tmp_path: Path) -> None:
    with gzip.open(shared_data / "csail.log.gz", "rt") as file:
        scans = [line.rstrip() for line in file if line.startswith("FLASER")][:199]
    words = scans[100].split()
    words[int(words[1]) + 5] = "1e6"
    log = read(tmp_path, *scans[:100], " ".join(words), *scans[101:])
    whole = read(tmp_path, *scans).episode
    assert told(log) == {"pose leaps away and back, line left out": (1, 101)}
    assert (log.episode.times == np.delete(whole.times, 100)).all()
    assert (log.episode.odometry.poses == np.delete(whole.odometry.poses, 100, axis=0)).all()


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "empty"),
        (b"hello\nworld\n", "no scan in 2 lines"),
        (bytes(range(256)) * 50, "FLASER"),
        (b"ODOM 0 0 0 0 0 0 1.0 host 0\n", "FLASER or ROBOTLASER1"),
        (b"FLASER 3 1 2\n", ":1: FLASER with as many readings"),
        (gzip.compress(b"hello\n" * 1000, mtime=0)[:-20], "complete gzip"),
    ],
)
def test_what_is_no_log_is_refused_in_one_line(
    tmp_path: Path, content: bytes, message: str
) -> None:
    path = tmp_path / "x.log"
    path.write_bytes(content)
    with pytest.raises(InputError, match=message) as caught:
        read_carmen(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_no_file_and_a_directory(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        read_carmen(tmp_path / "none.log")
    with pytest.raises(InputError, match="directory"):
        read_carmen(tmp_path)
    with pytest.raises(InputError, match="file name"):
        read_carmen("a\0b")


def test_a_gzip_cut_short_gives_the_lines_before_the_cut(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    lines = [
        flaser(k, ranges=" ".join(f"{r:.2f}" for r in rng.uniform(1, 9, 180))) for k in range(200)
    ]
    path = tmp_path / "cut.log.gz"
    path.write_bytes(gzip.compress("\n".join(lines).encode())[:-30_000])
    log = read_carmen(path)
    assert 50 < len(log.episode.scans) < 200
    assert "file damaged or cut short, the part before used" in told(log)


def test_a_damaged_gzip_gives_what_could_be_read(tmp_path: Path) -> None:
    path = tmp_path / "damaged.log.gz"
    packed = bytearray(gzip.compress((flaser(1) + "\n").encode()))
    packed[-6] ^= 1  # the check sum
    path.write_bytes(packed)
    log = read_carmen(path)
    assert log.episode.times.tolist() == [1]
    assert told(log) == {"file damaged or cut short, the part before used": (1, 1)}


def test_a_line_without_end_is_passed_over(tmp_path: Path) -> None:
    log = read(tmp_path, flaser(1), "FLASER 9 " + "1 " * 1_500_000, flaser(2))
    assert log.episode.times.tolist() == [1, 2]
    assert told(log) == {"garbled line left out": (1, 2)}


WORDS = st.sampled_from(["", "nan", "-1", "1e999", "180", "0", "x", "FLASER", "99999999999", "\0"])


@settings(max_examples=150)
@given(st.lists(st.tuples(st.integers(0, 5), st.integers(0, 30), WORDS), max_size=6))
def test_mutilated_logs_never_raise_anything_else(changes: list[tuple[int, int, str]]) -> None:
    short = "1.5 2 3 4 5 6"
    lines = [odom(1), flaser(1, ranges=short), robotlaser(2), robotlaser(2.5), odom(3)]
    lines = [line.split() for line in [*lines, flaser(3, ranges=short)]]
    for line, word, replacement in changes:
        lines[line][word % len(lines[line]) :][:1] = [replacement]
        lines[line][word % len(lines[line])] = replacement
    check_bytes("\n".join(map(" ".join, lines)).encode())


@settings(max_examples=100)
@given(st.binary(max_size=300), st.integers(0, 2000), st.booleans())
def test_junk_in_a_log_never_raises_anything_else(junk: bytes, at: int, packed: bool) -> None:
    log = "\n".join([odom(1), flaser(1), flaser(2)]).encode()
    log = gzip.compress(log) if packed else log
    check_bytes(log[:at] + junk + log[at + len(junk) :])


def check_bytes(content: bytes) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "x.log"
        path.write_bytes(content)
        try:
            episode = read_carmen(path).episode
        except InputError as error:
            assert "\n" not in str(error)  # noqa: PT017
        else:
            assert (np.diff(episode.times) > 0).all()
            assert len(episode.displacements()) == len(episode.scans)


def test_the_real_logs(shared_data: Path) -> None:
    found = {}
    for name in ("intel", "csail", "aces"):
        log = read_carmen(shared_data / f"{name}.log.gz")
        assert log.warnings == (), name
        found[name] = (
            len(log.episode.scans),
            len(log.episode.scans[0].ranges),
            len(log.episode.odometry),
            log.episode.scans[0].max_range,
            sum(int(scan.no_echo.sum()) for scan in log.episode.scans),
        )
    assert found == {
        "intel": (7584, 180, 13631, 81.83, 53286),
        "csail": (1988, 361, 1988, 81.83, 23711),
        "aces": (440, 180, 7374, 50.0, 620),
    }
