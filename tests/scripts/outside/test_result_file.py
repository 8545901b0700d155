# pyright: reportMissingImports=false
import numpy as np
import pytest
from dynslam_cli.outside.result_file import read_result

from slam.episode import Episode
from slam.errors import InputError
from slam.scan import Scan
from slam.trajectory import Trajectory

TIMES = np.array([100.0, 100.5, 101.0, 101.5])
EPISODE = Episode(
    tuple(Scan(np.ones(2), np.arange(2.0), 5.0, time=t) for t in TIMES),
    Trajectory(TIMES, np.zeros((4, 3))),
)
COLUMNS = "x y - theta stamp"


@pytest.mark.parametrize(
    ("stamps", "offset", "written"),
    [
        ("recording", 0.0, (100.5, 101.5)),
        ("recording", -900.0, (1000.5, 1001.5)),
        ("start", 0.0, (0.5, 1.5)),
        ("scan", 0.0, (1, 3)),
    ],
)
def test_columns_and_stamps_as_the_adapter_names_them(tmp_path, stamps, offset, written):
    path = tmp_path / "path.txt"
    path.write_text(f"# x y z theta t\n1 2 9 0.5 {written[0]}\n3 4 9 0.6 {written[1]}\n")
    found = read_result(path, EPISODE, COLUMNS, stamps, offset)
    assert found.times.tolist() == [100.5, 101.5]
    assert found.poses.tolist() == [[1, 2, 0.5], [3, 4, 0.6]]


def test_of_poses_with_one_stamp_the_last_one_counts(tmp_path):
    path = tmp_path / "path.txt"
    path.write_text("1 0 0 0 0\n2 0 0 0 0\n3 0 0 0 1\n")
    assert read_result(path, EPISODE, COLUMNS, "scan").poses[:, 0].tolist() == [2, 3]


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "no pose in it"),
        ("1 2 3\n", "expected 5 numbers `x y - theta stamp`"),
        ("0 0 0 0 4\n", "numbers of scans from 0 to 3"),
        ("0 0 0 0 0.5\n", "numbers of scans from 0 to 3"),
    ],
)
def test_mistakes_are_told(tmp_path, text, told):
    path = tmp_path / "path.txt"
    path.write_text(text)
    with pytest.raises(InputError, match=told):
        read_result(path, EPISODE, COLUMNS, "scan")
