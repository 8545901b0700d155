"""What another package brings by entry points is known by name."""

import subprocess
import sys
from pathlib import Path

VARIANT = """
from slam import DeadReckoning

def build(start, rng):
    return DeadReckoning(start)
"""
MAP = """
from slam import Static

class Own(Static):
    pass
"""
READER = """
import numpy as np
from slam import Episode, Reader, Scan, Trajectory

def recognises(path, head):
    return head.startswith(b"THEIRS")

def read(path):
    scan = Scan(np.ones(3), np.zeros(3), 10.0)
    return Episode((scan,), Trajectory(np.zeros(1), np.zeros((1, 3))))

reader = Reader(recognises, read)
"""


def with_package(
    folder: Path, group: str, entry: str, module: str, code: str
) -> subprocess.CompletedProcess[str]:
    """Run `code` where a package `theirs` is installed, with one entry point of a group of ours."""
    distribution = folder / "theirs-1.0.dist-info"
    distribution.mkdir()
    (distribution / "METADATA").write_text("Metadata-Version: 2.1\nName: theirs\nVersion: 1.0\n")
    (distribution / "entry_points.txt").write_text(f"[{group}]\ntheirs = {entry}\n")
    (folder / "theirs.py").write_text(module)
    code = f"import sys; sys.path.insert(0, {str(folder)!r}); import slam; {code}"
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)


def test_an_installed_package_brings_its_variant(tmp_path: Path):
    code = "print(slam.variants()[-1], type(slam.make('theirs')).__name__)"
    run = with_package(tmp_path, "dynslam.variants", "theirs:build", VARIANT, code)
    assert run.stdout.split() == ["theirs", "DeadReckoning"]


def test_an_installed_package_brings_its_map(tmp_path: Path):
    code = "print(slam.variants()[-1], type(slam.make('theirs-ml').map_model).__name__)"
    run = with_package(tmp_path, "dynslam.maps", "theirs:Own", MAP, code)
    assert run.stdout.split() == ["theirs-graph", "Own"]


def test_an_installed_package_brings_its_reader(tmp_path: Path):
    (tmp_path / "drive.xyz").write_bytes(b"THEIRS 1 2 3")
    code = f"print(len(slam.read_log({str(tmp_path / 'drive.xyz')!r}).episode.scans))"
    run = with_package(tmp_path, "dynslam.readers", "theirs:reader", READER, code)
    assert run.stdout.split() == ["1"]


def test_one_that_does_not_load_is_warned_of(tmp_path: Path):
    code = "print(slam.variants())"
    run = with_package(tmp_path, "dynslam.variants", "nowhere:build", VARIANT, code)
    assert "static-ml" in run.stdout
    assert "theirs" not in run.stdout
    assert "dynslam.variants 'theirs' (nowhere:build): No module named 'nowhere'" in run.stderr
