# pyright: reportMissingImports=false
import json
import math

import numpy as np
import pytest
from dynslam_cli import demo, main
from dynslam_cli.comparison import FEWEST_PAIRS, Case, comparison, findings
from dynslam_cli.table import markdown, summary
from dynslam_cli.trials import Trial, results, trials

import slam
from slam.benchmark.results import read

PICTURES = (
    "figure1-histogram.png",
    "figure2-3-likelihood.png",
    "figure4-map.png",
    "figure5-map.png",
    "figure6-map.png",
    "figure7-map.png",
    "figures4-7.png",
    "replay.gif",
)
NOT_TIMED = ("seconds", "ms_per_matched_scan")


def test_one_pair_end_to_end(tmp_path, capsys):
    assert main.status(["demo", "--out", str(tmp_path), "--seeds", "1", "--jobs", "1"]) == 0
    rows = read(tmp_path / "results.jsonl")
    assert len(rows) == 2 * len(slam.variants())
    for row in rows:
        assert row["versions"]["numpy"] == np.__version__
        assert row["episode"]["config"]["odometry"]["bias"] == pytest.approx(math.radians(60))
    for name in PICTURES:
        assert (tmp_path / name).stat().st_size > 10_000
    assert "dynamic-ml" in capsys.readouterr().out
    table = (tmp_path / "table.md").read_text().splitlines()
    assert sum(line.startswith("|") for line in table) == 2 + len(rows)


def test_results_do_not_depend_on_the_number_of_jobs():
    def told(jobs: int) -> str:
        rows = [row for part in results(trials(2), ["odometry"], jobs) for row in part]
        return json.dumps([{k: v for k, v in row.items() if k not in NOT_TIMED} for row in rows])

    assert told(1) == told(2)


def test_trials_are_pairs_of_seeds_that_nothing_was_chosen_on():
    assert trials(2) == [
        Trial(0, "static"),
        Trial(0, "moving"),
        Trial(1, "static"),
        Trial(1, "moving"),
    ]


def test_ctrl_c_keeps_the_episodes_that_are_done(tmp_path, monkeypatch, capsys):
    def impatient(todo, variants, jobs):
        yield from results(todo[:1], ["odometry", "static-ml", "dynamic-ml"], 1)
        raise KeyboardInterrupt

    monkeypatch.setattr(demo, "results", impatient)
    assert main.status(["demo", "--out", str(tmp_path), "--seeds", "2"]) == 130
    assert len(read(tmp_path / "results.jsonl")) == 3
    assert "interrupted" in capsys.readouterr().err


def result(variant: str, seed: int, ate: float, **others) -> dict:
    row = {"variant": variant, "doors": "moving", "seed": seed, "ate": ate, "heading_max": 0.1}
    row |= {"f1_5cm": 0.9, "brier_share_door": None, "failed": ate > 0.3}
    return row | {"ms_per_matched_scan": 1.0} | others


def test_the_table_by_hand():
    rows = [result("a", seed, ate) for seed, ate in enumerate((0.01, 0.02, 0.5))]
    (row,) = summary(rows)
    assert (row.ate_mm.value, row.ate_mm.low, row.ate_mm.high) == pytest.approx((20, 10, 500))
    assert row.failed_percent.value == pytest.approx(100 / 3)
    assert row.heading_deg.value == pytest.approx(math.degrees(0.1))
    assert math.isnan(row.brier.value)
    assert "| 20 (10 to 500) |" in markdown(rows)


def test_the_comparison_pairs_by_seed():
    rows = [result("a", seed, 0.02 + 0.001 * seed) for seed in range(6)]
    rows += [result("b", seed, 0.01 + 0.001 * seed) for seed in reversed(range(7))]
    ate, f1 = comparison(rows, Case("a", "moving"), Case("b", "moving"))
    assert ate == "ATE +10.0 mm (+10.0 to +10.0), p = 0.031"
    assert f1.startswith("F1 +0.000")


def test_too_few_pairs_are_told_as_such():
    rows = [result(name, seed, 0.1) for name in "ab" for seed in range(FEWEST_PAIRS - 1)]
    ate, _ = comparison(rows, Case("a", "moving"), Case("b", "moving"))
    assert ate == "ATE +0.0 mm (5 pairs, too few to judge)"


def test_findings_compare_the_maps_and_the_door_laws():
    rows = [
        result(f"{kind}-ml", seed, 0.1, doors=doors)
        for kind in ("static", "dynamic")
        for doors in ("static", "moving")
        for seed in range(6)
    ]
    text = findings(rows)
    assert "static-ml, moving doors, minus dynamic-ml, moving doors:" in text
    assert "static-ml, moving doors, minus static-ml, static doors:" in text
    assert "beta1" not in text
