"""A variant that another package brings by an entry point is known by name."""

import subprocess
import sys
from pathlib import Path


def with_package(
    folder: Path, name: str, entry: str, code: str
) -> subprocess.CompletedProcess[str]:
    """Run `code` where a package `name` is installed, with one entry point of our group."""
    distribution = folder / f"{name}-1.0.dist-info"
    distribution.mkdir()
    (distribution / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
    (distribution / "entry_points.txt").write_text(f"[dynslam.variants]\n{name} = {entry}\n")
    code = f"import sys; sys.path.insert(0, {str(folder)!r}); import slam; {code}"
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)


def test_an_installed_package_brings_its_variant(tmp_path: Path):
    (tmp_path / "theirs.py").write_text(
        "from slam.algorithms.dead_reckoning import DeadReckoning\n"
        "def build(start, rng):\n"
        "    return DeadReckoning(start)\n"
    )
    code = "print(slam.variants()[-1], type(slam.make('theirs')).__name__)"
    run = with_package(tmp_path, "theirs", "theirs:build", code)
    assert run.stdout.split() == ["theirs", "DeadReckoning"]


def test_one_that_does_not_load_is_warned_of(tmp_path: Path):
    run = with_package(tmp_path, "broken", "nowhere:build", "print(slam.variants())")
    assert "static-ml" in run.stdout
    assert "broken" not in run.stdout
    assert "variant 'broken' (nowhere:build): No module named 'nowhere'" in run.stderr
