"""What a killed process left beside a file is removed by the next writer of that file."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from slam.io.files import placing, replacing
from slam.io.leftovers import sweep

WRITE = """
import sys, time
from slam.io.files import {writer}
with {writer}(sys.argv[1]) as made:
    print("writing", flush=True)
    time.sleep(60)
"""


@pytest.mark.parametrize("writer", ["replacing", "placing"])
def test_what_a_killed_writer_left_is_removed_and_what_a_living_one_writes_is_not(
    tmp_path: Path, writer: str
) -> None:
    path = tmp_path / "map.png"
    process = subprocess.Popen(
        [sys.executable, "-c", WRITE.format(writer=writer), str(path)], stdout=subprocess.PIPE
    )
    assert process.stdout is not None
    assert process.stdout.readline() == b"writing\n"
    with replacing(path) as file:
        file.write(b"while the other writes")
    left = [one for one in tmp_path.iterdir() if one != path]
    assert len(left) == 1, "the living writer's"
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    process.stdout.close()
    with replacing(path) as file:
        file.write(b"after it was killed")
    assert [one.name for one in tmp_path.iterdir()] == ["map.png"]
    assert path.read_bytes() == b"after it was killed"


def test_other_files_are_no_leftovers(tmp_path: Path) -> None:
    names = {".map.png", ".map.png.kept", "map.png.tmp", ".other.png.1-a.tmp", "map.png"}
    for name in names:
        (tmp_path / name).write_text("mine")
    (tmp_path / ".map.png.2-b.tmp").symlink_to(tmp_path / "map.png")
    sweep(tmp_path / "map.png")
    assert {one.name for one in tmp_path.iterdir()} >= names
    assert (tmp_path / "map.png").read_text() == "mine"


def test_an_error_leaves_neither_the_file_nor_a_temporary_one(tmp_path: Path) -> None:
    for writer in (replacing, placing):
        with pytest.raises(ZeroDivisionError), writer(tmp_path / "map.png"):
            raise ZeroDivisionError
    assert not list(tmp_path.iterdir())


def test_permissions_are_those_of_any_new_file(tmp_path: Path) -> None:
    (tmp_path / "usual").touch()
    with replacing(tmp_path / "written") as file:
        file.write(b"x")
    assert (tmp_path / "written").stat().st_mode == (tmp_path / "usual").stat().st_mode
