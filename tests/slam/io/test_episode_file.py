import math
from pathlib import Path

import numpy as np
import pytest

from slam.episode import Episode, Truth
from slam.errors import InputError
from slam.geometry import Pose2
from slam.io.episode_file import FORMAT, load_episode, save_episode
from slam.scan import Scan
from slam.trajectory import Trajectory


def episode(with_truth: bool = True) -> Episode:
    """Three scans of 3, 1 and 2 beams, odometry that is denser than the scans."""
    rng = np.random.default_rng(5)
    scans = tuple(
        Scan(rng.random(n), rng.random(n), 4.0 + k, 0.1 * k, 0.3 * k, Pose2(0.1 * k, 0.2, -0.3))
        for k, n in enumerate((3, 1, 2))
    )
    scans[0].ranges[:2] = math.nan, math.inf
    odometry = Trajectory(np.linspace(0.0, 0.8, 5), rng.random((5, 3)))
    truth = Truth(rng.random((3, 3)), rng.random((6, 4)), rng.random((3, 2, 4)))
    return Episode(scans, odometry, truth if with_truth else None, {"seed": 3, "of": ["a", None]})


@pytest.fixture
def saved(tmp_path: Path) -> Path:
    save_episode(episode(), tmp_path / "drive.npz")
    return tmp_path / "drive.npz"


def test_load_gives_exactly_what_was_saved(saved: Path) -> None:
    before, after = episode(), load_episode(saved)
    for a, b in zip(before.scans, after.scans, strict=True):
        np.testing.assert_array_equal(a.ranges, b.ranges)
        np.testing.assert_array_equal(a.angles, b.angles)
        assert (a.max_range, a.min_range, a.time) == (b.max_range, b.min_range, b.time)
        assert a.mount == b.mount
    np.testing.assert_array_equal(before.odometry.times, after.odometry.times)
    np.testing.assert_array_equal(before.odometry.poses, after.odometry.poses)
    assert before.truth is not None
    assert after.truth is not None
    np.testing.assert_array_equal(before.truth.poses, after.truth.poses)
    np.testing.assert_array_equal(before.truth.walls, after.truth.walls)
    np.testing.assert_array_equal(before.truth.doors, after.truth.doors)
    assert after.meta == before.meta


def test_no_truth_stays_no_truth(tmp_path: Path) -> None:
    save_episode(episode(with_truth=False), tmp_path / "log.npz")
    assert load_episode(tmp_path / "log.npz").truth is None


def test_the_same_episode_gives_the_same_bytes(saved: Path, tmp_path: Path) -> None:
    save_episode(load_episode(saved), tmp_path / "again.npz")
    with np.load(saved) as a, np.load(tmp_path / "again.npz") as b:
        assert a.files == b.files
        for name in a.files:
            assert a[name].tobytes() == b[name].tobytes()


@pytest.mark.parametrize("kept", [0, 1, 100, 0.5, 0.9])
def test_a_truncated_file_is_told(saved: Path, kept: float) -> None:
    raw = saved.read_bytes()
    saved.write_bytes(raw[: kept if isinstance(kept, int) else int(kept * len(raw))])
    with pytest.raises(InputError, match=r"drive\.npz: not an episode saved by dynslam"):
        load_episode(saved)


def write_text(path: Path) -> None:
    path.write_text("FLASER 2 1.0 1.0 0 0 0 0 0 0 0 host 0\n")


def write_array(path: Path) -> None:
    with path.open("wb") as file:
        np.save(file, np.zeros(3))


def write_other_arrays(path: Path) -> None:
    np.savez(path, ranges=np.zeros(3))


def write_half_an_episode(path: Path) -> None:
    np.savez(path, format=FORMAT, meta="{}", beams=np.array([2]), ranges=np.zeros(2))


def write_pickle(path: Path) -> None:
    np.savez(path, format=np.array([{}], dtype=object))


@pytest.mark.parametrize(
    "write", [write_text, write_array, write_other_arrays, write_half_an_episode, write_pickle]
)
def test_a_foreign_file_is_told(tmp_path: Path, write) -> None:
    path = tmp_path / "other.npz"
    write(path)
    with pytest.raises(InputError, match=r"other\.npz: not an episode saved by dynslam"):
        load_episode(path)


def test_another_format_is_named_beside_the_one_expected(tmp_path: Path) -> None:
    np.savez(tmp_path / "new.npz", format="dynslam-episode-9")
    with pytest.raises(InputError, match=f"format dynslam-episode-9, expected {FORMAT}"):
        load_episode(tmp_path / "new.npz")


def test_a_missing_file_and_a_directory_are_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        load_episode(tmp_path / "none.npz")
    with pytest.raises(InputError, match="this is a directory"):
        load_episode(tmp_path)


def test_a_killed_write_leaves_the_old_file(saved: Path, monkeypatch) -> None:
    before = saved.read_bytes()

    def killed(file, **arrays) -> None:
        file.write(b"PK half of it")
        raise KeyboardInterrupt

    monkeypatch.setattr(np, "savez_compressed", killed)
    with pytest.raises(KeyboardInterrupt):
        save_episode(episode(with_truth=False), saved)
    assert saved.read_bytes() == before
    assert list(saved.parent.iterdir()) == [saved]


def test_motions_are_what_the_odometry_did_between_the_scans() -> None:
    drive = episode()
    displacements = drive.displacements()
    assert displacements[0] == Pose2()
    pose = Pose2.of(drive.odometry.at(drive.times)[0])
    for displacement in displacements:
        pose = pose @ displacement
    np.testing.assert_allclose(pose, drive.odometry.at(drive.times)[-1], atol=1e-12)
    assert drive.times.tolist() == [0.0, 0.3, 0.6]


def test_refused_with_what_was_wrong() -> None:
    drive = episode()
    assert drive.truth is not None
    with pytest.raises(InputError, match="at least one scan"):
        Episode((), drive.odometry)
    with pytest.raises(InputError, match="3 poses for 2 scans"):
        Episode(drive.scans[:2], drive.odometry, drive.truth)


def test_a_damaged_file_is_told_wherever_the_damage_is(saved: Path) -> None:
    raw, refused = saved.read_bytes(), 0
    for at in range(0, len(raw), 7):
        damaged = bytearray(raw)
        damaged[at] ^= 0xFF
        saved.write_bytes(damaged)
        try:
            load_episode(saved)
        except InputError:
            refused += 1
    assert refused > len(raw) / 7 / 3


def test_a_directory_that_is_not_there_is_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be written"):
        save_episode(episode(), tmp_path / "none" / "drive.npz")
