"""A recording's name."""

from pathlib import Path

import pytest

from scripts.recordings.source import stem


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("a.log.gz", "a"),
        ("a.log", "a"),
        ("a.b.csv", "a.b"),
        (".log", "log"),
        (".", None),
        ("a/..", None),
    ],
)
def test_name_without_endings(name, expected, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert stem(Path(name)) == (tmp_path.name if expected is None else expected)


def test_a_link_is_named_as_the_user_named_it(tmp_path):
    (tmp_path / "drive-0001.bag").touch()
    link = tmp_path / "kitchen.bag"
    link.symlink_to(tmp_path / "drive-0001.bag")
    assert stem(link) == "kitchen"
