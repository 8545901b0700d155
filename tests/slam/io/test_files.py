from pathlib import Path

import pytest

from slam.errors import InputError
from slam.io.files import placing, reading


def test_what_was_written_by_name_takes_the_place_of_what_was_there(tmp_path: Path) -> None:
    path = tmp_path / "a.mp4"
    path.write_text("old")
    with placing(path) as made:
        assert made.suffix == ".mp4"
        made.write_text("new")
        assert path.read_text() == "old"
    assert path.read_text() == "new"
    assert list(tmp_path.iterdir()) == [path]


def test_what_breaks_off_leaves_nothing_behind(tmp_path: Path) -> None:
    path = tmp_path / "a.mp4"

    def write() -> None:
        with placing(path) as made:
            made.write_text("half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write()
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_is_not_there_is_answered_with_near_names(tmp_path: Path) -> None:
    (tmp_path / "drive.log.gz").write_bytes(b"")
    (tmp_path / "other.npz").write_bytes(b"")
    for name, told in (("drve.log.gz", "; did you mean drive.log.gz?"), ("map.yaml", "")):
        with pytest.raises(InputError) as raised, reading(tmp_path / name):
            pass
        assert str(raised.value) == f"{tmp_path / name}: no such file{told}"


def test_where_nothing_can_be_written(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be written"), placing(tmp_path / "no" / "a.mp4"):
        pass
