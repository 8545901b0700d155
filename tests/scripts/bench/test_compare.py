# pyright: reportMissingImports=false
import json
from pathlib import Path

import pytest
from dynslam_cli import main
from dynslam_cli.bench.changes import changes
from dynslam_cli.report.scores import ATE

from ..results import Row, row, rows


def written(path: Path, found: list[Row]) -> Path:
    path.write_text("".join(json.dumps(r) + "\n" for r in found))
    return path


@pytest.fixture
def compared(tmp_path, capsys):
    def compare(before: list[Row], after: list[Row], *arguments: str) -> tuple[int, str]:
        paths = (written(tmp_path / "a.jsonl", before), written(tmp_path / "b.jsonl", after))
        status = main.status(["compare", *map(str, paths), *arguments])
        return status, capsys.readouterr().out

    return compare


def worsened(found: list[Row], variant: str, by: float) -> list[Row]:
    return [{**r, "ate": r["ate"] + by} if r["variant"] == variant else r for r in found]


def test_the_same_results_are_no_change(compared):
    status, told = compared(rows(), rows())
    assert status == 0
    assert "36 pairs of runs (36 before, 36 after)" in told
    assert "0 better, 0 worse" in told


def test_a_regression_is_found_and_named(compared):
    status, told = compared(rows(), worsened(rows(), "b", 0.005))
    assert status == 1
    assert "worse: b, doors moving: ATE 19.5 mm" in told
    assert "after minus before 5.0" in told
    assert "1 worse" in told


def test_an_improvement_is_none(compared):
    status, told = compared(rows(), worsened(rows(), "b", -0.005))
    assert status == 0
    assert "better: b, doors moving: ATE" in told


def test_what_is_worse_by_less_than_the_tolerance_passes(compared):
    slightly = worsened(rows(), "b", 1e-4)
    assert compared(rows(), slightly)[0] == 0
    assert compared(rows(), slightly, "--tolerance", "0")[0] == 1


def test_chance_is_no_regression(compared):
    import numpy as np

    rng = np.random.default_rng(1)
    noisy = [{**r, "ate": r["ate"] + 0.002 * rng.standard_normal()} for r in rows()]
    assert compared(rows(), noisy)[0] == 0


def test_few_pairs_are_no_evidence(compared):
    few = rows(seeds=5)
    assert compared(few, worsened(few, "b", 0.1))[0] == 0


def test_a_run_that_came_to_nothing_is_always_one(compared):
    broken = [row("a", r["seed"], None) if r["run"] == rows()[0]["run"] else r for r in rows()]
    status, told = compared(rows(), broken)
    assert status == 1
    assert "failed: a, doors moving, seed 0: it broke" in told
    assert compared(broken, rows())[0] == 0


def test_more_lost_runs_are_one():
    pairs = [(row("a", s, 0.1), {**row("a", s, 0.1), "failed": s < 9}) for s in range(12)]
    from dynslam_cli.bench.changes import LOST
    from scipy import stats

    (change,) = changes(pairs, [LOST])
    assert change.difference.value == pytest.approx(100 * 9 / 12)
    assert change.p == pytest.approx(stats.binomtest(9, 9).pvalue)
    assert change.verdict(0.02) == "worse"


def test_time_counts_on_request(compared):
    slower = [{**r, "ms_per_matched_scan": 2 * r["ms_per_matched_scan"]} for r in rows()]
    assert compared(rows(), slower)[0] == 0
    assert compared(rows(), slower, "--time")[0] == 1


def test_runs_that_are_missing_after_are_told(compared):
    status, told = compared(rows(), rows()[:-3])
    assert status == 0
    assert "3 of the runs before have no counterpart after" in told


def test_other_episodes_are_told(compared):
    others = [{**r, "episode": "other"} for r in rows()]
    assert "the episodes differ" in compared(rows(), others)[1]


def test_conditions_are_not_mixed():
    pairs = [(row("a", 0, 0.1, {"x": x}), row("a", 0, 0.2, {"x": x})) for x in (1.0, 2.0)]
    assert len(changes(pairs, [ATE])) == 2


@pytest.mark.parametrize(
    ("content", "told"),
    [("{", "b.jsonl:1: not a line of results"), ('{"a": 1}\n', "not the results of a bench"),
     ("[]\n", "not a line of results"), ('{"ate": NaN}', "NaN is no JSON"),
     ('{"condition": ["x"], "variant": "v", "seed": 1, "x": 1}', "not the results of a bench")],
)  # fmt: skip
def test_what_is_no_bench_is_refused(tmp_path, capsys, content, told):
    good, bad = written(tmp_path / "a.jsonl", rows()), tmp_path / "b.jsonl"
    bad.write_text(content + "\n")
    assert main.status(["compare", str(good), str(bad)]) == 2
    assert told in capsys.readouterr().err


def test_two_benches_that_share_nothing_are_refused(tmp_path, capsys):
    paths = [written(tmp_path / f"{v}.jsonl", [row(v, 0, 0.1)]) for v in "ab"]
    assert main.status(["compare", *map(str, paths)]) == 2
    assert "share no run" in capsys.readouterr().err
    assert main.status(["compare", str(paths[0]), str(tmp_path / "none.jsonl")]) == 2
    assert "none.jsonl" in capsys.readouterr().err


def test_the_folders_of_two_benches_will_do(tmp_path, capsys):
    folders = [tmp_path / name for name in ("before", "after")]
    for folder in folders:
        folder.mkdir()
        written(folder / "results.jsonl", rows())
    assert main.status(["compare", *map(str, folders)]) == 0
    assert "36 pairs of runs" in capsys.readouterr().out


def coded(found: list[Row], variant: str, code: tuple[str, str, str] | None) -> list[Row]:
    named = code and dict(zip(("package", "version", "digest"), code, strict=True))
    return [{**r, "code": named} if r["variant"] == variant else r for r in found]


def test_it_says_whose_code_a_variant_is_and_whether_it_changed(compared):
    ours, old, new = ("dynslam", "0.1", "abc"), ("mine", "1.0", "123"), ("mine", "1.1", "456")
    before = coded(coded(rows(), "a", ours), "b", old)
    _, told = compared(before, coded(before, "b", new))
    assert "code of b: mine 1.0 123 before, mine 1.1 456 after" in told
    assert "code of a" not in told
    _, told = compared(before, before)
    assert "code of b: mine 1.0 123 before and after" in told


def test_it_says_how_many_pairs_a_verdict_needs(compared):
    few = rows(seeds=5)
    _, told = compared(few, worsened(few, "b", 0.005), "--every")
    assert "comparisons have fewer than the 6 pairs that any verdict needs" in told
    assert "5 pairs; a verdict needs about 6" in told
    _, told = compared(rows(), worsened(rows(), "b", 0.005), "--every")
    assert "fewer than" not in told
