"""What is written is read again, within what each format keeps; through all pairs of formats."""

import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from slam.episode import Episode
from slam.errors import InputError
from slam.geometry import Pose2, wrap_angle
from slam.io.formats import read_log, write_log
from slam.scan import Scan
from slam.trajectory import Trajectory

ENDINGS = [".npz", ".csv", ".log", ".log.gz", ".bag", ".mcap", ".db3", ""]
# m of ranges, rad of angles, m and rad of poses, s of stamps, as their docstrings say
KEPT = {
    ".npz": (0, 0, 0, 0), ".csv": (5e-5, 1e-6, 1e-7, 0), ".log": (1e-4, 1e-6, 2e-6, 2e-6),
    ".bag": (1e-5, 1e-6, 1e-9, 1e-6),
}  # fmt: skip
number = st.floats(-1, 1)


@st.composite
def drives(draw: st.DrawFn) -> Episode:
    """Evenly spread beams either way round, on a robot that drives no more than robots do."""
    beams = draw(st.integers(2, 6))
    high = draw(st.floats(0.5, 80.0))
    low = draw(st.just(0.0) | st.floats(0.01, 0.4))
    first, step = 3 * draw(number), draw(st.sampled_from([-1, 1])) * draw(st.floats(0.01, 1.0))
    angles = first + step * np.arange(beams, dtype=np.float64)
    reading = st.floats(max(low, 0.01), high) | st.sampled_from(
        [math.inf, math.nan, 0.0, low, high]
    )
    start = draw(st.sampled_from([0.0, 1.7e9]))
    mount = Pose2(*(draw(number) for _ in range(3)))
    beam_time = draw(st.sampled_from([0.0, 1e-4]))
    scans = []
    for k in range(draw(st.integers(1, 3))):
        ranges = np.array([1.0, *(draw(reading) for _ in range(beams - 1))])
        time = start + k + 0.5 * abs(draw(number))
        scans.append(Scan(np.clip(ranges, -1, None), angles, high, low, time, mount, beam_time))
    times = start + 0.25 * np.arange(16, dtype=np.float64)
    poses = np.array([[5 * draw(number), 5 * draw(number), 3 * draw(number)] for _ in range(4)])
    return Episode(tuple(scans), Trajectory(times, np.repeat(poses, 4, axis=0)))


def through(drive: Episode, folder: Path, *endings: str) -> Episode:
    for number, ending in enumerate(endings):
        path = folder / f"drive{number}{ending}"
        write_log(drive, path)
        drive = read_log(path).episode
    return drive


def check(before: Episode, after: Episode, *endings: str) -> None:
    kept = [KEPT.get(one, KEPT[".log" if "log" in one else ".bag"]) for one in endings]
    far, turned, place, stamp = np.sum(kept, axis=0).astype(float).tolist()
    assert len(before.scans) == len(after.scans)
    for a, b in zip(before.scans, after.scans, strict=True):
        np.testing.assert_array_equal(a.hit, b.hit)
        np.testing.assert_array_equal(a.no_echo, b.no_echo)
        np.testing.assert_allclose(b.ranges[a.hit], a.ranges[a.hit], rtol=1e-5, atol=far)
        np.testing.assert_allclose(b.angles, a.angles, rtol=0, atol=10 * turned)
        assert b.time == pytest.approx(a.time, rel=0, abs=stamp)
        assert b.max_range == pytest.approx(a.max_range, rel=1e-6)
        np.testing.assert_allclose(b.mount[:2], a.mount[:2], rtol=0, atol=10 * place)
        assert abs(wrap_angle(b.mount.theta - a.mount.theta)) <= 10 * place
    at = before.times
    moved = after.odometry.at(at) - before.odometry.at(at)
    # while it moves, a stamp that is off by a bit is a place that is
    assert np.abs(moved[:, :2]).max() <= 10 * place + 60 * stamp
    assert np.abs(wrap_angle(moved[:, 2])).max() <= 10 * place + 60 * stamp


quickly = settings(
    max_examples=12,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)


@pytest.mark.parametrize("ending", ENDINGS)
@quickly
@given(drive=drives())
def test_scans_and_poses_survive(tmp_path_factory, ending: str, drive: Episode) -> None:
    folder = tmp_path_factory.mktemp("trip")
    check(drive, through(drive, folder, ending), ending)


@pytest.mark.parametrize("there", [".npz", ".csv", ".log", ".bag", ".mcap", ".db3"])
@pytest.mark.parametrize("back", [".npz", ".csv", ".log.gz", ".bag", ".mcap", ""])
@settings(quickly, max_examples=2)
@given(drive=drives())
def test_there_and_back_between_all_pairs(
    tmp_path_factory, there: str, back: str, drive: Episode
) -> None:
    folder = tmp_path_factory.mktemp("trip")
    check(drive, through(drive, folder, there, back, there), there, back, there)


@pytest.mark.parametrize("ending", [".npz", ".csv", ".log", ".bag", ".mcap", ".db3"])
def test_what_was_written_is_written_alike_again(tmp_path: Path, ending: str) -> None:
    """Nothing drifts: from the second time on, scans are the same bit by bit."""
    rng = np.random.default_rng(3)
    angles = np.linspace(-2.0, 2.0, 30)
    scans = tuple(
        Scan(rng.uniform(0.2, 12.0, 30), angles, 9.87654321, 0.123456789, 10 + k / 7)
        for k in range(5)
    )
    drive = Episode(scans, Trajectory(10 + np.arange(5) / 7, rng.uniform(-5, 5, (5, 3))))
    once = through(drive, tmp_path, ending)
    again = through(once, tmp_path / "..", ending)
    for a, b in pairwise((once, again)):
        for one, other in zip(a.scans, b.scans, strict=True):
            np.testing.assert_array_equal(one.ranges, other.ranges)
            np.testing.assert_array_equal(drive.scans[0].hit, scans[0].hit)


@pytest.mark.parametrize("ending", ENDINGS[4:])
def test_one_beam(tmp_path: Path, ending: str) -> None:
    one = Scan(np.array([2.0]), np.array([0.5]), 9.0, time=1.0)
    drive = Episode((one,), Trajectory(np.array([1.0]), np.zeros((1, 3))))
    after = through(drive, tmp_path, ending).scans[0]
    assert (after.ranges.tolist(), after.angles.tolist()) == ([2.0], [0.5])


@pytest.mark.parametrize("ending", [one for one in ENDINGS if "log" not in one])
def test_no_odometry_stays_none(tmp_path: Path, ending: str) -> None:
    scans = tuple(Scan(np.ones(2), np.array([0.0, 0.1]), 9.0, time=1.0 + k) for k in range(2))
    still = Trajectory(np.array([1.0, 2.0]), np.zeros((2, 3)))
    after = through(Episode(scans, still, meta={"odometry": ""}), tmp_path, ending)
    assert not after.has_odometry
    assert not after.odometry.poses.any()


@pytest.mark.parametrize("ending", [one for one in ENDINGS if one not in (".log", ".log.gz")])
def test_the_time_between_beams_is_kept(tmp_path: Path, ending: str) -> None:
    one = Scan(np.ones(3), np.array([0.0, 0.1, 0.2]), 9.0, time=1.0, beam_time=0.001)
    drive = Episode((one,), Trajectory(np.array([1.0, 2.0]), np.zeros((2, 3))))
    assert through(drive, tmp_path, ending).scans[0].beam_time == pytest.approx(0.001)


@pytest.mark.parametrize("time", [-1.0, 2.0**31, 1e10])
@pytest.mark.parametrize("ending", ENDINGS[4:])
def test_times_that_ros_has_no_numbers_for(tmp_path: Path, ending: str, time: float) -> None:
    one = Scan(np.ones(2), np.array([0.0, 0.1]), 9.0, time=time)
    drive = Episode((one,), Trajectory(np.array([time]), np.zeros((1, 3))))
    with pytest.raises(InputError, match=r"times from 0 to 2\*\*31 s"):
        write_log(drive, tmp_path / f"drive{ending}")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("ending", ENDINGS[1:])
def test_beams_that_no_other_format_has_words_for(tmp_path: Path, ending: str) -> None:
    for angles in (np.array([0.0, 0.1, 0.5]), np.empty(0)):
        one = Scan(np.ones(len(angles)), angles, 9.0, time=1.0)
        drive = Episode((one,), Trajectory(np.array([1.0]), np.zeros((1, 3))))
        with pytest.raises(InputError, match="beams"):
            write_log(drive, tmp_path / f"drive{ending}")
        assert list(tmp_path.iterdir()) == []


def test_an_ending_that_is_not_known_lists_those_that_are(tmp_path: Path) -> None:
    one = Scan(np.ones(2), np.array([0.0, 0.1]), 9.0)
    drive = Episode((one,), Trajectory(np.array([0.0]), np.zeros((1, 3))))
    with pytest.raises(InputError, match=r"ending tells .*: \.npz, \.csv, .*\.db3, or none"):
        write_log(drive, tmp_path / "drive.txt")
    (tmp_path / "folder").mkdir()
    with pytest.raises(InputError, match="is there already"):
        write_log(drive, tmp_path / "folder")
