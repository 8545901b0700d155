"""A variant that another package brings by an entry point is known by name."""

import subprocess
import sys
from pathlib import Path

CODE = "import slam; print(slam.variants()[-1], type(slam.make('theirs')).__name__)"


def test_an_installed_package_brings_its_variant(tmp_path: Path):
    (tmp_path / "theirs.py").write_text(
        "from slam.algorithms.dead_reckoning import DeadReckoning\n"
        "def build(start, rng):\n"
        "    return DeadReckoning(start)\n"
    )
    distribution = tmp_path / "theirs-1.0.dist-info"
    distribution.mkdir()
    (distribution / "METADATA").write_text("Metadata-Version: 2.1\nName: theirs\nVersion: 1.0\n")
    (distribution / "entry_points.txt").write_text("[dynslam.variants]\ntheirs = theirs:build\n")
    code = f"import sys; sys.path.insert(0, {str(tmp_path)!r}); {CODE}"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout.split() == ["theirs", "DeadReckoning"]


def test_one_that_does_not_load_is_warned_of(tmp_path: Path):
    distribution = tmp_path / "broken-1.0.dist-info"
    distribution.mkdir()
    (distribution / "METADATA").write_text("Metadata-Version: 2.1\nName: broken\nVersion: 1.0\n")
    (distribution / "entry_points.txt").write_text("[dynslam.variants]\nbroken = nowhere:build\n")
    code = f"import sys; sys.path.insert(0, {str(tmp_path)!r}); import slam; print(slam.variants())"
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "static-ml" in run.stdout
    assert "broken" not in run.stdout
    assert "variant 'broken' (nowhere:build): No module named 'nowhere'" in run.stderr
