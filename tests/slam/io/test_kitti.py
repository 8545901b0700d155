import tempfile
from pathlib import Path

import numpy as np
import pytest
from evo.tools import file_interface
from hypothesis import given, settings
from hypothesis import strategies as st

from slam.errors import InputError
from slam.geometry import wrap_angle
from slam.io.kitti import read_kitti, write_kitti
from slam.trajectory import Trajectory

POSES = np.array([[1.0, 2.0, 0.5], [-3.0, 4.0, -2.5], [100.25, -7.0, 3.0]])
DRIVE = Trajectory(np.array([976052857.0, 976052857.33753, 976052859.5]), POSES)


@settings(max_examples=50)
@given(st.lists(st.floats(-1e4, 1e4), min_size=30, max_size=30))
def test_round_trip(values: list[float]) -> None:
    poses = np.array(values).reshape(10, 3)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.txt"
        write_kitti(Trajectory(np.arange(10.0), poses), path)
        back = read_kitti(path)
    assert np.abs(back[:, :2] - poses[:, :2]).max() < 1e-7
    assert np.abs(wrap_angle(back[:, 2] - poses[:, 2])).max() < 1e-8


def test_evo_reads_it_with_x_ahead_y_left_and_z_up(tmp_path: Path) -> None:
    path = tmp_path / "poses.txt"
    write_kitti(DRIVE, path)
    read = file_interface.read_kitti_poses_file(path)
    assert np.allclose(read.positions_xyz, np.column_stack([POSES[:, :2], np.zeros(3)]))
    yaw = read.get_orientations_euler("szyx")[:, 0]
    assert np.allclose(wrap_angle(yaw - POSES[:, 2]), 0.0)
    for pose, (_, _, theta) in zip(read.poses_se3, POSES, strict=True):
        assert np.allclose(pose[:3, 0], [np.cos(theta), np.sin(theta), 0.0])
        assert np.allclose(pose[:3, 2], [0.0, 0.0, 1.0])


def test_the_stamps_lie_beside_one_a_line(tmp_path: Path) -> None:
    times = write_kitti(DRIVE, tmp_path / "poses.txt")
    assert times == tmp_path / "poses-times.txt"
    assert times.read_text().split() == ["976052857.000000", "976052857.337530", "976052859.500000"]


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "no pose"),
        ("1 0 0 0 0 1 0 0 0 0 1\n", ":1: expected 12 numbers"),
        ("1 0 0 0 0 1 0 0 0 0 1 0\n2 0 0 0 0 1 0 0 0 0 1 0\n", ":2: expected a pose"),
        ("1 0 0 0 0 1 0 0 0 0 -1 0\n", ":1: expected a pose"),
        ("0 0 1 0 0 1 0 0 -1 0 0 0\n", ":1: expected x ahead, y left and z up"),
    ],
    ids=["empty", "too short", "stretched", "mirrored", "a camera that has turned"],
)
def test_what_is_no_planar_trajectory_is_refused(tmp_path: Path, text: str, told: str) -> None:
    path = tmp_path / "poses.txt"
    path.write_text(text)
    with pytest.raises(InputError, match=told):
        read_kitti(path)


def test_where_it_cannot_be_written(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be written"):
        write_kitti(DRIVE, tmp_path / "nowhere" / "poses.txt")
