"""Small files that were read in gigabytes, and messages of every reader."""

import gzip
import io
import json
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

from slam.errors import InputError
from slam.io import guard
from slam.io.formats import read_log
from slam.io.guard import FLOOR, PER_BYTE, guarded, take
from slam.sessions.session import Session
from tests.slam.io.samples import samples

MEASURE = """
import json, resource, sys, time
import slam.io.bags
from slam.errors import InputError
from slam.io.formats import read_log
from slam.sessions.session import Session
def peak():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
for sample in sys.argv[2:]:
    read_log(sample)
before, begun = peak(), time.process_time()
try:
    (Session.load if "session" in sys.argv[1] else read_log)(sys.argv[1])
    told = ""
except InputError as error:
    told = str(error)
print(json.dumps([told, peak() - before, time.process_time() - begun]))
"""
OWN_MB, MAX_S = 60, 20.0  # of the process beside; a hundred times a file of the same size


def session(path: Path) -> None:
    scans = 400_000
    np.savez_compressed(
        path, format="dynslam-session-1", poses=np.zeros((scans, 3), np.int8),
        beams=np.ones(scans, np.int8), ranges=np.ones(scans, np.int8),
        angles=np.zeros(scans, np.int8), limits=np.ones((scans, 3), np.int8),
        mounts=np.zeros((scans, 3), np.int8),
    )  # fmt: skip


def table(path: Path) -> None:
    beams = 100_000
    with gzip.open(path, "wb", 1) as file:
        file.write(b"# angle_min: 0\n# angle_increment: 0.00001\n")
        file.write(b"time," + b",".join(b"r%d" % k for k in range(beams)) + b"\n")
        for time in range(400):
            file.write(b"%d" % time + b",1" * beams + b"\n")


def scans(path: Path) -> None:
    np.savez_compressed(
        path, times=np.arange(500), angles=np.zeros(80_000, np.int8),
        ranges=np.ones((500, 80_000), np.int8),
    )  # fmt: skip


def carmen(path: Path) -> None:
    path.write_bytes(gzip.compress(b"ODOM 0 0 0 0 0 0 1 h 1\n" * 500_000, 5))


SMALL_FILES = {"session.npz": session, "table.csv": table, "scans.npz": scans, "a.log.gz": carmen}


@pytest.mark.parametrize("name", SMALL_FILES)
def test_a_small_file_takes_memory_in_proportion(tmp_path: Path, name: str) -> None:
    """As in the attack: such files took 1.6 to 6.5 GB, and up to a minute."""
    path = tmp_path / name
    SMALL_FILES[name](path)
    known = tmp_path / "known"
    known.mkdir()
    for sample in ("plain.npz", "table.csv", "flaser.log", "episode.npz"):
        (known / sample).write_bytes(samples()[sample])
    done = subprocess.run(
        [sys.executable, "-c", MEASURE, str(path), *map(str, known.iterdir())],
        capture_output=True, text=True, check=True, cwd=Path(__file__).parents[3],
    )  # fmt: skip
    told, taken, seconds = json.loads(done.stdout.splitlines()[-1])
    assert "takes more memory than files of its size" in told
    assert told.startswith(str(path))
    assert taken < FLOOR + OWN_MB + PER_BYTE * path.stat().st_size / 1e6
    assert seconds < MAX_S


def test_the_bound_can_be_raised(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "scans.npz"
    np.savez_compressed(
        path, times=np.arange(50.0), angles=np.linspace(0, 1, 1000), ranges=np.ones((50, 1000))
    )
    monkeypatch.setenv("DYNSLAM_READ_MB", "0.5")
    with pytest.raises(InputError, match=r"scans\.npz: .*DYNSLAM_READ_MB=MB allows more"):
        read_log(path)
    monkeypatch.setenv("DYNSLAM_READ_MB", "5")
    assert len(read_log(path).episode.scans) == 50
    monkeypatch.setenv("DYNSLAM_READ_MB", "much")
    with pytest.raises(InputError, match="DYNSLAM_READ_MB must be a number of MB, got 'much'"):
        read_log(path)


def test_ordinary_files_are_far_below_the_bound(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A hundredth of the floor is enough for every sample."""
    monkeypatch.setenv("DYNSLAM_READ_MB", f"{FLOOR / 100}")
    for name in (
        "flaser.log",
        "packed.log.gz",
        "table.csv",
        "ros1.bag",
        "ros2.mcap",
        "episode.npz",
    ):
        (tmp_path / name).write_bytes(samples()[name])
        read_log(tmp_path / name)


def test_what_is_read_within_another_file_is_taken_from_its_budget(tmp_path: Path) -> None:
    (tmp_path / "outer").write_bytes(bytes(100))
    with guarded(tmp_path / "outer"):
        with guarded(tmp_path / "inner"):
            take(1e6 * FLOOR)
        take(100 * PER_BYTE)
        with pytest.raises(InputError, match="takes more memory"):
            take(1)
    take(1e15)  # of no file


@pytest.mark.parametrize(
    ("error", "told"),
    [
        (InputError("no scan"), "some: no scan"),
        (InputError("x" * 10_000), "some: x{397}\\.\\.\\.$"),
        (RecursionError(), "some: is nested too deeply"),
        (MemoryError(), "some: there is not enough memory to read it"),
    ],
)
def test_the_message_begins_with_the_file(tmp_path: Path, error: Exception, told: str) -> None:
    with pytest.raises(InputError, match=told) as raised, guarded(tmp_path / "some"):
        raise error
    with pytest.raises(InputError, match=told) as again, guarded(tmp_path / "some"):
        raise raised.value
    assert str(again.value) == str(raised.value), "named once"


@pytest.mark.parametrize(
    "head",
    [
        b"{'descr': '<f8', 'fortran_order': False, 'shape': (3, }",
        b"{'descr': '<f8', 'fortran_order': False, 'shape': " + b"(" * 3000,
        b"{'descr': '<f8', 'fortran_order': False, 'shape': (-3,), }",
        b"{'descr': '|V0', 'fortran_order': False, 'shape': (1000000000000,), }",
    ],
)
def test_the_head_of_an_array_that_is_none(tmp_path: Path, head: bytes) -> None:
    """An open bracket was tokenize.TokenError."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as packed:
        data = b"\x93NUMPY\x02\x00" + len(head).to_bytes(4, "little") + head
        for name in ("times", "ranges", "angles", "format"):
            packed.writestr(f"{name}.npy", data)
    for name, read in (("session.npz", Session.load), ("scans.npz", read_log)):
        (tmp_path / name).write_bytes(file.getvalue())
        with pytest.raises(InputError, match=name):
            read(tmp_path / name)


def test_the_bound_is_what_the_documentation_says() -> None:
    page = (Path(__file__).parents[3] / "docs" / "reliability.md").read_text()
    assert f"{guard.FLOOR} MB" in page
    assert f"{guard.PER_BYTE} times" in page
    assert guard.VARIABLE in page
