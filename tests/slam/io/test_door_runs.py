"""A table of runs is read, and what is wrong in one is told with its line."""

from pathlib import Path

import pytest

from slam import InputError
from slam.io.door_runs import HEADER, read_door_runs, write_door_runs


def written(path: Path, *lines: str) -> Path:
    path.write_text("\n".join(lines) + "\n")
    return path


def test_runs_and_gaps_are_read(tmp_path: Path) -> None:
    runs = read_door_runs(written(tmp_path / "door.csv", HEADER, "0,60,0", "", "120,180.5,1"))
    assert runs.begin.tolist() == [0.0, 120.0]
    assert runs.end.tolist() == [60.0, 180.5]
    assert runs.state.tolist() == [0, 1]


def test_what_is_written_is_read(tmp_path: Path) -> None:
    lines = HEADER, "1451865600.000,1451865660.250,0", "1451865720.000,1451865780.125,1"
    runs = read_door_runs(written(tmp_path / "door.csv", *lines))
    write_door_runs(runs, tmp_path / "again.csv")
    assert (tmp_path / "again.csv").read_text() == "\n".join(lines) + "\n"


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ((HEADER,), "no runs"),
        (("0,60,0",), "door.csv:1: expected the header"),
        ((HEADER, "0,60"), "door.csv:2: expected three numbers"),
        ((HEADER, "0,sixty,1"), "door.csv:2: expected three numbers"),
        ((HEADER, "0,60,3"), "door.csv: state must be 0 or 1, got 3"),
        ((HEADER, "0,nan,1"), "door.csv: end_s must be finite"),
        ((HEADER, "0,60,1", "30,90,0"), "run 1 begins at 30 s, before 60 s"),
    ],
)
def test_what_is_wrong_is_told(tmp_path: Path, lines: tuple[str, ...], message: str) -> None:
    with pytest.raises(InputError, match=message):
        read_door_runs(written(tmp_path / "door.csv", *lines))


def test_a_missing_file_is_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        read_door_runs(tmp_path / "none.csv")
