# pyright: reportMissingImports=false
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from dynslam_cli.bench.suites import drive
from dynslam_cli.trials import cache, pool
from dynslam_cli.trials.jobs import Trial
from dynslam_cli.trials.worker_process import WorkerProcess, WorkerProcesses

from slam import registry
from slam.benchmark.results import read
from slam.metrics.episode_scorer import EpisodeScorer

from ..results import SMALL
from .broken import BROKEN

VARYING = (
    "seconds",
    "cpu_seconds",
    "ms_per_matched_scan",
    "peak_memory_mb",
    "memory_mb",
    "finished",
    "commit",  # of a checkout that is being worked on
)


SHORT = """
name = "short"
variants = ["static-ml", "odometry"]
seeds = 1
[[case]]
name = "one"
env = "DoorCorridor-v0"
max_episode_steps = 150
[[case]]
name = "two"
env = "DoorLoop-v0"
max_episode_steps = 150
"""


@pytest.fixture
def short(tmp_path: Path) -> str:
    """A suite of two cases of 15 s each."""
    path = tmp_path / "short.toml"
    path.write_text(SHORT)
    return str(path)


@pytest.fixture
def short_case(tmp_path: Path) -> str:
    """A suite of one such case."""
    path = tmp_path / "short_case.toml"
    path.write_text(SHORT[: SHORT.rindex("[[case]]")])
    return str(path)


def rows_of(out: Path) -> list[dict]:
    return read(out / "results.jsonl")


def untimed(rows: list[dict]) -> list[str]:
    return sorted(json.dumps({k: v for k, v in row.items() if k not in VARYING}) for row in rows)


def test_every_variant_sees_the_same_episodes(small):
    rows = rows_of(small)
    assert len(rows) == 2 * 2 * 2
    assert len({row["run"] for row in rows}) == len(rows)
    seen = {(row["doors"], row["seed"], row["variant"]): row["episode"] for row in rows}
    for doors in ("static", "moving"):
        for seed in (5000, 5001):
            assert seen[doors, seed, "static-ml"] == seen[doors, seed, "odometry"]
    assert len(set(seen.values())) == 4


def test_a_row_says_what_made_it_and_holds_every_score(small):
    row = next(r for r in rows_of(small) if r["variant"] == "static-ml")
    assert row["slam"]["type"] == "MaximumLikelihood"
    assert row["source"]["config"]["doors"]["type"] == "Doors"
    assert row["versions"]["dynslam"]
    assert row["host"]["cores"] == os.cpu_count()
    assert row["error"] is None
    assert 0 < row["ate_bound"] < row["ate"] < 0.1
    assert row["ate"] == pytest.approx(row["ate_online"])
    assert len(row["error_curve"]) == 50
    mean_square = sum(e**2 for e in row["error_curve"]) / 50
    assert mean_square**0.5 == pytest.approx(row["ate"], rel=0.02)
    assert row["seconds"] > 0
    assert row["peak_memory_mb"] > 50
    assert sum(row["calibration"]["cells"]) > 1000
    assert row["duration"] == pytest.approx(41, abs=3)


def test_the_scores_are_those_of_a_run_in_this_process(small):
    from slam.benchmark.run import build, run

    episode = drive("DoorCorridor-v0", 5001, doors="moving").make()
    done = run(build("static-ml", episode, 5001), episode)
    expected = EpisodeScorer(episode).scores(done.poses, done.grid)
    row = next(
        r
        for r in rows_of(small)
        if (r["variant"], r["doors"], r["seed"]) == ("static-ml", "moving", 5001)
    )
    assert {name: row[name] for name in expected} == expected


def test_results_do_not_depend_on_the_number_of_jobs(bench, short_case, tmp_path):
    one, two = tmp_path / "one", tmp_path / "two"
    variants = ("--variants", "static-ml,static-pf")  # the particle filter draws numbers
    for jobs, out in (("1", one), ("2", two)):
        assert bench(short_case, *variants, "--jobs", jobs, out=out) == 0
    assert untimed(rows_of(one)) == untimed(rows_of(two))
    assert len(rows_of(one)) == 2


def test_no_two_variants_share_a_name_in_the_results_and_any_is_a_files():
    names = ["a/b", "a-b", "<script>", "a:b", "L" * 300, "static-ml/beam", "static-ml-beam"]
    source = drive("DoorCorridor-v0", 5000)
    found = [Trial("s", {}, source, name).name for name in names]
    assert len(set(found)) == len(names)
    assert all(re.fullmatch(r"[\w.-]{1,120}", name) for name in found)


def test_resuming_what_is_done_runs_nothing(bench, small, monkeypatch, capsys):
    before = (small / "results.jsonl").read_bytes()
    monkeypatch.setattr(WorkerProcesses, "do", lambda self, job: pytest.fail("was run again"))
    assert bench(*SMALL, "--resume") == 0
    assert "8 runs, 0 without a result" in capsys.readouterr().out
    assert (small / "results.jsonl").read_bytes() == before


def test_an_earlier_bench_is_not_overwritten(bench, small, capsys):
    before = (small / "results.jsonl").read_bytes()
    assert bench(*SMALL) == 2
    assert "--resume" in capsys.readouterr().err
    assert (small / "results.jsonl").read_bytes() == before


def test_resuming_runs_what_is_missing_and_nothing_else(bench, small):
    path = small / "results.jsonl"
    whole = rows_of(small)
    lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(b"".join(lines[:6]) + lines[6][:100])  # killed in the middle of a line
    assert bench(*SMALL, "--resume") == 0
    again = path.read_bytes().splitlines(keepends=True)
    assert again[:6] == lines[:6]
    assert untimed(rows_of(small)) == untimed(whole)


def test_resuming_with_more_seeds_adds_to_what_is_there(bench, small, monkeypatch):
    started, start = [], WorkerProcess._start
    monkeypatch.setattr(WorkerProcess, "_start", lambda self: started.append(self) or start(self))
    assert bench("paper", "--seeds", "3", "--variants", "static-ml,odometry", "--resume") == 0
    assert sorted({row["seed"] for row in rows_of(small)}) == [5000, 5001, 5002]
    assert len(rows_of(small)) == 12
    assert len(started) == 1  # which records the episodes and runs the variants on them


def test_killed_at_any_moment_it_loses_the_runs_in_flight_alone(bench, short, tmp_path):
    out = tmp_path / "out"
    suite = (short, "--seeds", "3", "--variants", "static-ml,dynamic-ml", "--jobs", "2")
    command = [sys.executable, "-m", "dynslam_cli.main", "bench", *suite, "--out", str(out)]
    path, kept = out / "results.jsonl", b""
    for least in (2, 7):  # twice: the second time it had been resumed
        again = [*command, "--resume"] if kept else command
        child = subprocess.Popen(again, stderr=subprocess.DEVNULL)
        until = time.monotonic() + 100
        while (path.read_bytes().count(b"\n") if path.exists() else 0) < least:
            assert time.monotonic() < until
            assert child.poll() is None
            time.sleep(0.02)
        child.send_signal(signal.SIGKILL)
        child.wait()
        now = path.read_bytes()
        assert now.startswith(kept)
        kept = now[: now.rfind(b"\n") + 1]
    assert bench(*suite, "--resume") == 0
    assert path.read_bytes().startswith(kept)
    rows = rows_of(out)
    assert len(rows) == len({row["run"] for row in rows}) == 3 * 2 * 2
    assert all(row["error"] is None for row in rows)


def test_variants_that_fail_or_hang_stop_nothing_else(
    bench, short_case, tmp_path, monkeypatch, capsys
):
    monkeypatch.setattr(registry, "_BUILDERS", dict(registry._BUILDERS))
    for name, builder in BROKEN.items():
        registry.register(name, builder)
    names = ",".join(["static-ml", *BROKEN])
    arguments = (short_case, "--variants", names, "--limit", "15", "--jobs", "4")
    assert bench(*arguments, report=True) == 0
    rows = rows_of(tmp_path / "out")
    assert len(rows) == 1 + len(BROKEN)
    errors = {row["variant"]: row["error"] for row in rows}
    assert errors["static-ml"] is None
    assert errors["talks"] is None  # what it says does not mix with the results
    assert errors["numpys"] is None
    assert errors["late"] is None  # it has scores, and no picture
    assert "not JSON compliant" in errors["far"]
    assert "ZeroDivisionError: nothing to divide by (broken.py:" in errors["raises"]
    assert "pose at scan 100 is not finite" in errors["lost"]
    assert "time limit of 15 s" in errors["sleeps"]
    assert "in sleeps" in errors["sleeps"]  # where it hung
    assert "time limit of 15 s" in errors["holds"]
    assert "status 3; these are my last words" in errors["leaves"]
    assert "signal 11" in errors["crashes"]
    assert all(row["failed"] for row in rows if row["error"])
    told = capsys.readouterr()
    assert "11 runs, 7 without a result" in told.out
    assert "failed: " in told.err
    page = (tmp_path / "out" / "report.html").read_text()
    assert "Runs without a result" in page


def test_a_variant_of_the_users_own_takes_part_by_name(bench, short, tmp_path, monkeypatch):
    monkeypatch.setattr(registry, "_BUILDERS", dict(registry._BUILDERS))
    registry.register("mine", lambda start, rng: registry.make("static-ml", start))
    assert bench(short, "--variants", "static-ml,mine") == 0
    scores = {(r["case"], r["variant"]): r["ate"] for r in rows_of(tmp_path / "out")}
    assert scores["two", "mine"] == scores["two", "static-ml"]


def test_one_that_cannot_be_sent_is_refused_before_anything_runs(bench, monkeypatch, capsys):
    monkeypatch.setattr(registry, "_BUILDERS", dict(registry._BUILDERS))
    lock = threading.Lock()
    registry.register("mine", lambda start, rng: lock)  # type: ignore[arg-type]
    assert bench("paper", "--variants", "mine") == 2
    assert "'mine' cannot be sent to another process" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("papers",), "unknown suite 'papers'; did you mean paper?"),
        (("paper", "--variants", "best-ml"), "unknown variant 'best-ml'"),
        (("paper", "--seeds", "0"), "seeds must be a whole number of at least 1"),
        (("paper", "--first", "-1"), "first must be a whole number"),
        (("paper", "--jobs", "0"), "jobs must be at least 1"),
        (("paper", "--limit", "0"), "limit must be a finite number"),
        (("logs",), "--logs FOLDER"),
        (("logs", "--logs", "/nowhere"), "a folder of logs was expected"),
        (("none.toml",), "none.toml: no such file"),
        (("paper", "--cluster", "tcp://127.0.0.1:9"), "no Dask scheduler"),
        (("paper", "--cluster", "nonsense://x"), "no Dask scheduler"),
    ],
)
def test_mistakes_are_told_and_nothing_is_written(
    bench, tmp_path, monkeypatch, capsys, arguments, told
):
    monkeypatch.setattr(pool, "CONNECT_TIMEOUT", 1.0)
    assert bench(*arguments) == 2
    assert told in capsys.readouterr().err
    assert not (tmp_path / "out" / "results.jsonl").exists()


def test_an_episode_is_recorded_once_and_read_again(monkeypatch, tmp_path):
    monkeypatch.setenv("DYNSLAM_CACHE", str(tmp_path))
    source = drive("DoorCorridor-v0", 5003)
    first = cache.episode_of(source)
    monkeypatch.setattr(type(source), "make", lambda self: pytest.fail("recorded twice"))
    again = cache.episode_of(drive("DoorCorridor-v0", 5003))
    assert (again.truth.poses == first.truth.poses).all()
    assert len(list(tmp_path.glob("*.npz"))) == 1


def test_a_damaged_one_is_recorded_anew(monkeypatch, tmp_path):
    monkeypatch.setenv("DYNSLAM_CACHE", str(tmp_path))
    source = drive("DoorCorridor-v0", 5003)
    cache.episode_of(source)
    cache.path_of(source).write_bytes(b"half of an epis")
    assert len(cache.episode_of(source).scans) > 300
    assert cache.path_of(source).stat().st_size > 100_000


def test_an_episode_that_cannot_be_kept_is_made_all_the_same(monkeypatch, tmp_path):
    (tmp_path / "file").touch()
    monkeypatch.setenv("DYNSLAM_CACHE", str(tmp_path / "file"))
    assert len(cache.episode_of(drive("DoorCorridor-v0", 5003, max_episode_steps=9)).scans) == 10


def test_a_cached_drive_of_another_source_is_recorded_again():
    """A file under another's name was taken for it."""
    one, other = (drive("DoorCorridor-v0", seed, max_episode_steps=9) for seed in (5003, 5004))
    right = cache.episode_of(other)
    cache.episode_of(one)
    shutil.copy(cache.path_of(one), cache.path_of(other))
    for _ in range(2):
        found = cache.episode_of(other)
        assert found.scans[5].ranges.tolist() == right.scans[5].ranges.tolist()
        assert found.meta == right.meta, "as without a cache"


def test_a_damaged_picture_of_a_run_is_left_out_of_the_report(bench, small, capsys):
    """It was a traceback at --resume."""
    for path in (small / "examples").iterdir():
        path.write_bytes(path.read_bytes()[:1000])
    assert bench(*SMALL, "--resume", report=True) == 0
    told = [line for line in capsys.readouterr().err.splitlines() if "report: " not in line]
    assert told
    assert all(line.endswith("left out") and ": not a recorded run" in line for line in told)


def test_runs_that_are_there_twice_count_once(bench, small, capsys):
    """As two benches in one folder left them: every interval was too narrow."""
    path = small / "results.jsonl"
    path.write_bytes(2 * path.read_bytes())
    assert bench(*SMALL, "--resume") == 0
    told = capsys.readouterr()
    assert "8 runs are in it again; the last one counts" in told.err
    assert "8 runs, 0 without a result" in told.out


def test_a_cache_that_cannot_be_written_is_replaced_by_a_temporary_one(
    monkeypatch, tmp_path, capsys
):
    """It stopped a bench."""
    (tmp_path / "file").touch()
    (tmp_path / "temp").mkdir()
    monkeypatch.setenv("DYNSLAM_CACHE", str(tmp_path / "file"))
    monkeypatch.setattr(cache, "own_folder", lambda: tmp_path / "temp")
    source = drive("DoorCorridor-v0", 5003, max_episode_steps=9)
    cache.episode_of(source)
    assert cache.path_of(source).is_file()
    assert cache.path_of(source).parent == tmp_path / "temp" / "drives"
    assert "cannot be written; drives are recorded into" in capsys.readouterr().err


@pytest.mark.parametrize("line", ["no json", '{"ate": 1.0}', "[]"])
def test_a_file_that_holds_something_else_is_not_gone_on_with(bench, tmp_path, capsys, line):
    path = tmp_path / "out" / "results.jsonl"
    path.parent.mkdir()
    path.write_text(line + "\n")
    assert bench(*SMALL, "--resume") == 2
    assert "results.jsonl" in capsys.readouterr().err
    assert path.read_text() == line + "\n"


def test_what_a_killed_process_left_half_written_goes_after_a_day(monkeypatch, tmp_path):
    monkeypatch.setenv("DYNSLAM_CACHE", str(tmp_path))
    old, new = (tmp_path / f".a.npz.{k}.tmp" for k in (1, 2))
    for path, age in ((old, 2 * cache.DAY), (new, 10.0)):
        path.write_bytes(b"half")
        os.utime(path, (time.time() - age, time.time() - age))
    cache.prune()
    assert not old.exists()
    assert new.exists()


def test_what_was_not_used_for_the_longest_time_goes_first(monkeypatch, tmp_path):
    monkeypatch.setenv("DYNSLAM_CACHE", str(tmp_path))
    for age, name in enumerate(("new", "old", "oldest")):
        path = tmp_path / f"{name}.npz"
        path.write_bytes(bytes(100))
        os.utime(path, (1000 - age, 1000 - age))
    cache.prune(250)
    assert sorted(path.stem for path in tmp_path.glob("*.npz")) == ["new", "old"]


def test_sources_of_other_content_have_other_keys():
    one = drive("DoorCorridor-v0", 5000)
    assert one.key == drive("DoorCorridor-v0", 5000).key
    others = [
        drive("DoorCorridor-v0", 5001),
        drive("DoorCorridorStatic-v0", 5000),
        drive("DoorCorridor-v0", 5000, doors="static"),
        drive("DoorCorridor-v0", 5000, every=2),
        drive("DoorCorridor-v0", 5000, max_episode_steps=50),
    ]
    assert len({one.key, *(other.key for other in others)}) == 6


def test_another_suite_in_the_folder_is_not_mixed_with(bench, small, tmp_path, capsys):
    before = (tmp_path / "out" / "results.jsonl").read_bytes()
    assert bench("worlds", "--seeds", "1", "--variants", "odometry", "--resume") == 2
    assert "holds the suite paper" in capsys.readouterr().err
    assert (tmp_path / "out" / "results.jsonl").read_bytes() == before
