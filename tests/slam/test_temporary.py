"""Installed read-only and run by a user without a home: compiled code goes to a folder of its own.

A file where a folder is to be made stops every user, root too.
"""

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from slam import temporary

HERE = Path(__file__).parents[2]
USE = """
import numpy as np
from slam.scan import Scan
print(Scan(np.ones(1), np.zeros(1), 5.0).points.tolist())
"""


@pytest.fixture
def sealed(tmp_path: Path) -> Path:
    """A copy of the library beside whose modules nothing can be cached."""
    ignored = shutil.ignore_patterns("__pycache__")
    shutil.copytree(HERE / "slam", tmp_path / "site" / "slam", ignore=ignored)
    for folder in [tmp_path / "site" / "slam", *(tmp_path / "site").rglob("*/")]:
        if folder.is_dir() and folder.name != "__pycache__":
            (folder / "__pycache__").touch()
    return tmp_path / "site"


def imported(site: Path, temp: Path, **more: str) -> subprocess.CompletedProcess[str]:
    kept = {k: v for k, v in os.environ.items() if not k.startswith(("NUMBA", "XDG"))}
    return subprocess.run(
        [sys.executable, "-B", "-c", USE], cwd=site, text=True, capture_output=True, check=False,
        env=kept | {"HOME": os.devnull, "PYTHONPATH": str(site), "TMPDIR": str(temp)} | more,
    )  # fmt: skip


def test_without_a_home_and_a_writable_package_kernels_are_kept_in_a_temporary_folder(
    sealed: Path, tmp_path: Path
) -> None:
    """Was `RuntimeError: cannot cache function: no locator available`, in every command."""
    (tmp_path / "temp").mkdir()
    done = imported(sealed, tmp_path / "temp")
    assert done.returncode == 0, done.stderr
    assert "[[1.0, 0.0]]" in done.stdout
    assert done.stderr.count("compiled code is kept in") == 1, "said once"
    own = tmp_path / "temp" / f"dynslam-{os.getuid()}"
    assert own.stat().st_mode & 0o777 == 0o700
    assert list((own / "numba").rglob("*.nbi")), "and found there by the next process"
    named = imported(sealed, tmp_path / "temp", NUMBA_CACHE_DIR=str(tmp_path / "named"))
    assert named.returncode == 0, named.stderr
    assert not named.stderr
    assert list((tmp_path / "named").rglob("*.nbi"))


def test_where_nothing_can_be_written_kernels_are_compiled_each_time(
    sealed: Path, tmp_path: Path
) -> None:
    """Python itself refuses to run without any temporary folder: ours alone cannot be made."""
    (tmp_path / "temp").mkdir()
    (tmp_path / "temp" / f"dynslam-{os.getuid()}").mkdir(mode=0o700)
    (tmp_path / "temp" / f"dynslam-{os.getuid()}" / "numba").touch()
    done = imported(sealed, tmp_path / "temp")
    assert done.returncode == 0, done.stderr
    assert "[[1.0, 0.0]]" in done.stdout


@pytest.fixture
def temp(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    monkeypatch.setattr(temporary, "own_folder", temporary.own_folder.__wrapped__)
    return tmp_path


def test_a_folder_that_others_may_write_to_is_not_trusted(temp: Path) -> None:
    """Numba loads what lies in it, so another user could run code as this one."""
    own = temp / f"dynslam-{os.getuid()}"
    own.mkdir()
    own.chmod(0o777)
    assert temporary.own_folder() != own
    own.chmod(0o700)
    assert temporary.own_folder() == own


def test_a_link_or_a_file_of_that_name_is_not_followed(temp: Path) -> None:
    own = temp / f"dynslam-{os.getuid()}"
    (temp / "elsewhere").mkdir(mode=0o700)
    own.symlink_to(temp / "elsewhere")
    assert temporary.own_folder() != own
    own.unlink()
    own.touch()
    assert temporary.own_folder().parent == temp


def test_a_user_without_a_home_gets_one(temp: Path, monkeypatch, capsys) -> None:
    """A user id without an entry in /etc/passwd and no $HOME: `~` stays as it is."""
    monkeypatch.delenv("HOME")
    monkeypatch.setattr(os.path, "expanduser", lambda path: path)
    temporary.provide_home()
    assert os.environ["HOME"] == str(temp / f"dynslam-{os.getuid()}")
    assert capsys.readouterr().err.count("this user has no home") == 1


def test_a_home_is_left_as_it_is(temp: Path, monkeypatch, capsys) -> None:
    monkeypatch.setenv("HOME", "/somewhere")
    temporary.provide_home()
    assert os.environ["HOME"] == "/somewhere"
    assert not capsys.readouterr().err
