# pyright: reportMissingImports=false
"""Outside programs in a bench: a small one of our own, and the ready-made ones where they are."""

import os
import shutil
import sys
from pathlib import Path

import pytest
from dynslam_cli.outside.adapter import READY

from slam.benchmark.results import read
from slam.io.episode_file import load_episode

from .test_bench import SHORT, rows_of

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="outside systems need Linux")

ONE_CASE = SHORT[: SHORT.rindex("[[case]]")]
DEAD_RECKONING = """
import math, sys
from scan_table import read_table
table = read_table(sys.argv[1])
x, y, turn = 5.0, 5.0, math.pi / 2  # a frame of its own
with open(sys.argv[2], "w") as file:
    for k in range(0, len(table.times), 7):
        a, b, theta = table.poses[k]
        print(table.times[k] - 50, x - b, y + a, theta + turn, table.ranges.shape[1], file=file)
"""
TOML = """
log = "csv"
commands = ["{python} {folder}/reckon.py {log} {out}"]
columns = "stamp x y theta -"
offset = 50.0
max_beams = 60
"""
BROKEN = {
    "crash": "import os; os.kill(os.getpid(), 11)",
    "hang": "import time; time.sleep(100)",
    "silent": "pass",
    "elsewhere": "import sys; open(sys.argv[2], 'w').write('1 2 3 4 5\\n')",
    "large": "x = bytearray(600_000_000); import time; time.sleep(100)",
}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch) -> Path:
    """Adapters of our own, on the path where they are looked for."""
    made = tmp_path / "adapters"
    made.mkdir()
    shutil.copy(READY / "scan_table.py", made)
    (made / "reckon.py").write_text(DEAD_RECKONING)
    (made / "reckon.toml").write_text(TOML)
    for name, code in BROKEN.items():
        (made / f"{name}.py").write_text(code)
        text = TOML.replace("reckon", name) + "memory_mb = 400\n"
        (made / f"{name}.toml").write_text(text)
    monkeypatch.setenv("DYNSLAM_OUTSIDE", str(made))
    return made


@pytest.fixture
def short(tmp_path: Path) -> str:
    path = tmp_path / "short.toml"
    path.write_text(ONE_CASE)
    return str(path)


def test_a_program_is_scored_on_the_same_episode_as_ours_by_the_same_scores(
    bench, folder, short, tmp_path
):
    variants = "odometry,outside:reckon"
    assert bench(short, "--variants", variants, report=True) == 0
    ours, theirs = sorted(rows_of(tmp_path / "out"), key=lambda row: row["variant"])
    assert theirs["variant"] == "outside:reckon"
    assert theirs["error"] is None
    assert theirs["episode"] == ours["episode"]
    for score in ("ate", "heading_max", "rpe_translation", "ate_aligned"):
        assert theirs[score] == pytest.approx(ours[score], rel=1e-3), score
    assert theirs["f1_5cm"] == pytest.approx(ours["f1_5cm"], abs=0.05)
    assert "ate_online" not in theirs
    assert theirs["matched"] == -(-theirs["scans"] // 7)
    assert theirs["seconds"] > theirs["cpu_seconds"] * 0.5 > 0.02
    assert 10 < theirs["peak_memory_mb"] < 200
    assert ours["cpu_seconds"] > 0
    assert theirs["slam"]["commands"] == ["{python} {folder}/reckon.py {log} {out}"]
    assert (tmp_path / "out" / "examples" / f"{theirs['run']}.npz").exists()
    assert "outside:reckon" in (tmp_path / "out" / "report.html").read_text()


def test_it_is_given_the_recording_with_fewer_beams_and_without_the_truth(
    bench, folder, short, tmp_path
):
    kept = tmp_path / "kept.npz"
    (folder / "copy.toml").write_text(
        f'commands = ["cp {{log}} {kept}", "false"]\nlog = "npz"\nmax_beams = 100\n'
    )
    assert bench(short, "--variants", "outside:copy") == 0
    shown = load_episode(kept)
    assert shown.truth is None
    assert shown.meta == {}
    assert {len(scan.ranges) for scan in shown.scans} == {91}  # each second one of 181
    assert "false: ended with status 1" in rows_of(tmp_path / "out")[0]["error"]


def test_a_crash_a_limit_and_a_trajectory_that_fits_nothing_count_as_failed(
    bench, folder, short, tmp_path, capsys
):
    names = ",".join(["odometry", *(f"outside:{name}" for name in BROKEN)])
    assert bench(short, "--variants", names, "--limit", "10") == 0
    errors = {row["variant"]: row["error"] for row in rows_of(tmp_path / "out")}
    assert errors.pop("odometry") is None
    assert "ended by signal 11" in errors["outside:crash"]
    assert "more than the time limit of 10 s" in errors["outside:hang"]
    assert "trajectory.tum" in errors["outside:silent"]
    assert "0 of 1 poses have the stamp of a scan" in errors["outside:elsewhere"]
    assert "more than the memory limit of 400 MB" in errors["outside:large"]
    assert "5 without a result" in capsys.readouterr().out


def test_an_unknown_program_is_answered_before_anything_runs(bench, folder, short, capsys):
    assert bench(short, "--variants", "odometry,outside:recon") == 2
    assert "did you mean outside:reckon" in capsys.readouterr().err
    assert bench(short, "--variants", "outside:/nowhere/mine.toml") == 2
    assert "/nowhere/mine.toml" in capsys.readouterr().err


READY_MADE = {
    "mrpt-icp-slam": lambda: shutil.which(os.environ.get("ICP_SLAM", "icp-slam")),
    "mrpt-rbpf-slam": lambda: shutil.which(os.environ.get("RBPF_SLAM", "rbpf-slam")),
    "yag-slam": lambda: os.environ.get("YAG_SLAM_PYTHON"),
}


@pytest.mark.parametrize("name", READY_MADE)
def test_the_ready_made_ones_find_their_way_where_they_are_installed(bench, short, tmp_path, name):
    if not READY_MADE[name]():
        pytest.skip(f"{name} is not installed here: see docs/rivals.md")
    assert bench(short, "--variants", f"odometry,outside:{name}") == 0
    found = {row["variant"]: row for row in read(tmp_path / "out" / "results.jsonl")}
    theirs = found[f"outside:{name}"]
    assert theirs["error"] is None
    assert theirs["ate"] < found["odometry"]["ate"]
