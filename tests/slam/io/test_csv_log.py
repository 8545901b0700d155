import math
from pathlib import Path

import numpy as np
import pytest

from slam.errors import InputError
from slam.geometry import Pose2
from slam.io.csv_log import read_csv
from slam.io.formats import kind_of, read_log

HEAD = "# angle_min: -0.5\n# angle_increment: 0.5\n"
TABLE = (
    HEAD
    + "# range_max: 9\ntime,x,y,theta,r0,r1,r2\n1,0,0,0,1,inf,\n1.5,1,0,0,,,\n2,2,0,0,nan,2,9\n"
)


def read(tmp_path: Path, text: str | bytes):
    path = tmp_path / "some.csv"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return read_csv(path)


def test_the_documented_layout(tmp_path: Path) -> None:
    drove = read(tmp_path, TABLE).episode
    assert drove.times.tolist() == [1, 2]
    assert drove.odometry.times.tolist() == [1, 1.5, 2]
    assert drove.odometry.poses[:, 0].tolist() == [0, 1, 2]
    one, two = drove.scans
    assert one.angles.tolist() == [-0.5, 0, 0.5]
    np.testing.assert_array_equal(one.ranges, [1, math.inf, math.nan])
    assert two.no_echo.tolist() == [False, False, True]
    assert (one.max_range, one.min_range, one.mount) == (9, 0, Pose2())


@pytest.mark.parametrize(
    "text",
    [
        b"\xef\xbb\xbf" + TABLE.encode(),
        TABLE.replace("\n", "\r\n").encode(),
        TABLE.replace(",", " , ").encode(),
        b"\n\n# a remark\n" + TABLE.encode(),
    ],
)
def test_as_spreadsheets_write_it(tmp_path: Path, text: bytes) -> None:
    """With a byte order mark, and the line ends of Windows."""
    path = tmp_path / "some.txt"
    path.write_bytes(text)
    assert kind_of(path) == "csv"
    assert read_log(path).episode.times.tolist() == [1, 2]


def test_without_poses_there_is_no_odometry(tmp_path: Path) -> None:
    drove = read(tmp_path, HEAD + "time,r0\n1,2\n2,3\n").episode
    assert not drove.has_odometry
    assert drove.scans[0].max_range == 81.83


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", r"some\.csv: no row of numbers"),
        (HEAD + "time,r0\n", r"some\.csv: no row of numbers"),
        ("time,r0\n1,2\n", r"some\.csv: expected a line `# angle_min: \.\.\.`"),
        (HEAD + "stamp,r0\n1,2\n", r"some\.csv:3: expected names `time,r0"),
        (HEAD + "time,x,r0\n1,2,3\n", r"some\.csv:3: expected names"),
        (HEAD + "time;r0\n1;2\n", r"some\.csv:3: expected names"),
        (HEAD + "time,x,y,theta\n1,2,3,4\n", r"some\.csv:3: expected columns of ranges"),
        (HEAD + "time\n1\n", r"some\.csv:3: expected columns of ranges"),
        (HEAD + "time,r0\n1,2,3\n", r"some\.csv:4: expected 2 columns, got 3"),
        (HEAD + "time,r0\n1,two\n", r"some\.csv:4: expected numbers, got '1,two'"),
        (HEAD + "time,r0\nnan,2\n", r"some\.csv:4: expected a finite time"),
        (HEAD + "time,r0\n2,2\n1,2\n", r"some\.csv:5: expected a later time"),
        (HEAD + "time,r0\n1,\n", r"some\.csv: no row with a range"),
        (HEAD + "time,x,y,theta,r0\n1,,,,2\n", r"some\.csv: no row with a finite x, y, theta"),
        (HEAD + "# range_max: -1\ntime,r0\n1,2\n", r"some\.csv: a scan needs 0 <= min_range"),
        (HEAD + "# mount: 1 2\ntime,r0\n1,2\n", "expected 3 finite number"),
        ("# angle_min: -90\n# angle_increment: 1e9\ntime,r0\n1,2\n", "expected angles in"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_told_with_its_line(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        read(tmp_path, text)


def test_columns_without_end(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"some\.csv:1: a line of over 1 MB"):
        read(tmp_path, "time," * 300_000)
    with pytest.raises(InputError, match=r"some\.csv:4: expected a finite time, got '9{60}'"):
        read(tmp_path, HEAD + "time,r0\n" + "9" * 5000 + ",1\n")
