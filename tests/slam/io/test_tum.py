import tempfile
from pathlib import Path

import numpy as np
import pytest
from evo.tools import file_interface
from hypothesis import given, settings
from hypothesis import strategies as st

from slam.errors import InputError
from slam.geometry import wrap_angle
from slam.io.tum import read_tum, write_tum
from slam.trajectory import Trajectory


@settings(max_examples=50)
@given(
    st.lists(st.floats(0, 2e9), min_size=1, max_size=10, unique=True),
    st.lists(st.floats(-1e4, 1e4), min_size=30, max_size=30),
)
def test_round_trip_keeps_every_bit_of_the_stamps(times: list[float], values: list[float]) -> None:
    poses = np.array(values).reshape(10, 3)[: len(times)]
    trajectory = Trajectory(np.sort(times), poses)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.tum"
        write_tum(trajectory, path)
        back = read_tum(path)
    assert (back.times == trajectory.times).all()
    assert np.abs(back.poses[:, :2] - poses[:, :2]).max() < 1e-8
    assert np.abs(wrap_angle(back.poses[:, 2] - poses[:, 2])).max() < 1e-8


def test_evo_reads_it_and_stamps_have_six_decimals(tmp_path: Path) -> None:
    path = tmp_path / "a.tum"
    trajectory = Trajectory(
        np.array([976052857.0, 976052857.33753]), np.array([[1.0, 2, 0.5], [3, 4, -2.5]])
    )
    write_tum(trajectory, path)
    stamps = [line.split()[0] for line in path.read_text().splitlines()[1:]]
    assert stamps == ["976052857.000000", "976052857.337530"]
    read = file_interface.read_tum_trajectory_file(path)
    assert (read.timestamps == trajectory.times).all()
    assert read.positions_xyz[:, :2] == pytest.approx(trajectory.poses[:, :2])
    assert [np.arctan2(m[1, 0], m[0, 0]) for m in read.poses_se3] == pytest.approx([0.5, -2.5])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("# nothing\n", "no pose"),
        ("1 0 0 0 0 0 0 1\n\n2 0 0\n", r"a\.tum:3: expected 8 numbers"),
        ("1 0 0 0 0 0 0 x\n", r"a\.tum:1: expected 8 numbers"),
        ("1 0 0 0 0 0 0 inf\n", r"a\.tum:1"),
        ("1 0 0 0 0 0 0 0\n", r"a\.tum:1: expected a unit quaternion"),
        ("2 0 0 0 0 0 0 1\n# x\n1 0 0 0 0 0 0 1\n", r"a\.tum:3: expected a later"),
    ],
)
def test_bad_files_are_refused(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "a.tum").write_text(text)
    with pytest.raises(InputError, match=message):
        read_tum(tmp_path / "a.tum")
