import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slam.episode import Episode
from slam.errors import InputError
from slam.geometry import Pose2, wrap_angle
from slam.io.carmen.messages import flaser_angles
from slam.io.carmen.reader import read_carmen
from slam.io.carmen.writer import write_carmen
from slam.scan import Scan
from slam.trajectory import Trajectory


def drive(seed: int, angles: np.ndarray, max_range: float, mount: Pose2) -> Episode:
    """Scans with echoes, without, and without any reading; odometry between and at the scans."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 5))
    times = 1e9 + np.cumsum(rng.uniform(0.01, 2.0, 2 * n))
    scans = []
    for time in times[::2].tolist():
        ranges = rng.uniform(0.05, 1.1 * max_range, len(angles))
        ranges[rng.random(len(angles)) < 0.2] = np.nan
        ranges[rng.random(len(angles)) < 0.2] = np.inf
        scans.append(Scan(ranges, angles, max_range, 0.02, time, mount))
    poses = rng.uniform(-15, 15, (2 * n, 3))  # none leaps away from the others
    kept = times if seed % 2 else times[1::2]
    return Episode(tuple(scans), Trajectory(kept, poses[: len(kept)]))


def assert_same(back: Episode, episode: Episode) -> None:
    assert back.times == pytest.approx(episode.times, abs=1e-6)
    poses, expected = back.odometry.at(back.times), episode.odometry.at(episode.times)
    assert np.abs(poses[:, :2] - expected[:, :2]).max() < 1e-5
    assert np.abs(wrap_angle(poses[:, 2] - expected[:, 2])).max() < 1e-5
    for a, b in zip(back.scans, episode.scans, strict=True):
        assert (a.no_echo == b.no_echo).all()
        assert (a.hit == b.hit).all()
        assert np.allclose(a.ranges[a.hit], b.ranges[b.hit], rtol=0, atol=1.6e-4)
        assert np.allclose(a.angles, b.angles, rtol=0, atol=1e-6)
        assert a.max_range == pytest.approx(b.max_range, rel=1e-12)
        assert a.mount == pytest.approx(b.mount, abs=1e-5)


fans = st.sampled_from([flaser_angles(n) for n in (180, 181, 361)]) | st.builds(
    np.linspace, st.floats(-3, -0.1), st.floats(0.1, 3), st.integers(2, 40)
)
mounts = st.just(Pose2()) | st.builds(Pose2, st.floats(-1, 1), st.floats(-1, 1), st.floats(-3, 3))


@settings(max_examples=60)
@given(st.integers(0, 1000), fans, st.floats(1, 80), mounts, st.sampled_from(["log", "log.gz"]))
def test_what_is_written_is_read_back(
    seed: int, angles: np.ndarray, max_range: float, mount: Pose2, ending: str
) -> None:
    episode = drive(seed, angles, max_range, mount)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"a.{ending}"
        write_carmen(episode, path)
        log = read_carmen(path)
    assert log.warnings == ()
    assert_same(log.episode, episode)
    if seed % 2:
        assert len(log.episode.odometry) == len(episode.odometry)


def test_flaser_where_it_fits_and_robotlaser_otherwise(tmp_path: Path) -> None:
    path = tmp_path / "a.log"
    write_carmen(drive(1, flaser_angles(181), 8.0, Pose2()), path)
    assert "FLASER 181" in path.read_text()
    assert "PARAM robot_front_laser_max 8.0" in path.read_text()
    write_carmen(drive(1, flaser_angles(181), 8.0, Pose2(0.1)), path)
    assert "ROBOTLASER1 0 -1.5707" in path.read_text()
    assert "FLASER" not in path.read_text()


def test_rounding_makes_no_echo_of_an_echo(tmp_path: Path) -> None:
    ranges = np.full(180, 7.99999)
    scan = Scan(ranges, flaser_angles(180), 8.0)
    write_carmen(Episode((scan,), Trajectory(np.zeros(1), np.zeros((1, 3)))), tmp_path / "a.log")
    assert read_carmen(tmp_path / "a.log").episode.scans[0].hit.all()


def test_the_same_episode_gives_the_same_bytes(tmp_path: Path) -> None:
    for name in ("a.log.gz", "b.log.gz"):
        write_carmen(drive(3, flaser_angles(180), 8.0, Pose2()), tmp_path / name)
    assert (tmp_path / "a.log.gz").read_bytes() == (tmp_path / "b.log.gz").read_bytes()


def test_uneven_beams_are_refused_and_leave_no_file(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="evenly"):
        write_carmen(drive(1, np.array([0.0, 0.1, 0.3]), 8.0, Pose2()), tmp_path / "a.log")
    assert list(tmp_path.iterdir()) == []


def test_an_unwritable_place_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    for place in (tmp_path / "none" / "a.log", tmp_path / "file" / "a.log"):
        with pytest.raises(InputError, match="cannot be written"):
            write_carmen(drive(1, flaser_angles(181), 8.0, Pose2()), place)
