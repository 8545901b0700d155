# pyright: reportMissingImports=false
import io
import math

import numpy as np
import pytest
from dynslam_cli import main
from dynslam_cli.demo import run_demo
from dynslam_cli.demo.comparison import MIN_PAIRS, VariantCase, comparison, findings
from dynslam_cli.demo.demo import VARIANTS
from dynslam_cli.demo.table import markdown, summary, terminal
from dynslam_cli.figures.known_poses import known, mapped
from dynslam_cli.figures.likelihood import surface, surprise
from dynslam_cli.trials.pool import here
from rich.console import Console

from agents import record_corridor
from slam.benchmark.results import read
from slam.geometry import Pose2

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


def test_one_pair_end_to_end(tmp_path, capsys):
    assert main.status(["demo", "--out", str(tmp_path), "--seeds", "1", "--jobs", "1"]) == 0
    rows = read(tmp_path / "results.jsonl")
    assert len(rows) == 2 * len(VARIANTS.split(","))
    for row in rows:
        assert 0 < row["ate_bound"] < min(0.01, row["ate"])
        assert row["versions"]["numpy"] == np.__version__
        assert row["source"]["config"]["odometry"]["bias"] == pytest.approx(math.radians(60))
    for name in PICTURES:
        assert (tmp_path / name).stat().st_size > 10_000
    assert "dynamic-ml" in capsys.readouterr().out
    table = (tmp_path / "table.md").read_text().splitlines()
    assert sum(line.startswith("|") for line in table) == 2 + len(rows) + 2
    assert sum(line.startswith("| bound |") for line in table) == 2


def test_in_the_pictured_drive_a_door_misleads_the_static_map_alone():
    episode = record_corridor(run_demo.PICTURED_SEED, "moving")
    moment = surprise(episode)
    pose = Pose2.of(known(episode).poses[moment])
    off = []
    for variant in ("static-ml/beta1", "dynamic-ml/beta1"):
        robot = mapped(variant, episode, until=moment)
        off.append(np.hypot(*surface(robot, episode.scans[moment], pose).peaks[0]))
    assert off[0] > 0.1
    assert off[1] < 0.05


def test_ctrl_c_keeps_the_episodes_that_are_done(tmp_path, monkeypatch, capsys):
    def impatient(todo, jobs, processes):
        if todo[0].suite == "warm-up":
            return
        assert [(t.source.seed, t.condition["doors"]) for t in todo[::7]] == [
            (0, "static"),
            (0, "moving"),
            (1, "static"),
            (1, "moving"),
        ]
        yield from here(todo[:3], 1)
        raise KeyboardInterrupt

    monkeypatch.setattr(run_demo, "results_of", impatient)
    assert main.status(["demo", "--out", str(tmp_path), "--seeds", "2"]) == 130
    assert len(read(tmp_path / "results.jsonl")) == 3
    assert "interrupted" in capsys.readouterr().err


def result(variant: str, seed: int, ate: float, **others) -> dict:
    row = {"variant": variant, "doors": "moving", "seed": seed, "ate": ate, "heading_max": 0.1}
    row |= {"f1_5cm": 0.9, "brier_share_door": None, "failed": ate > 0.3}
    return row | {"ms_per_matched_scan": 1.0} | others


def test_the_variants_can_be_chosen(tmp_path, monkeypatch):
    told = []

    def noted(todo, jobs, processes):
        if todo[0].suite == "warm-up":
            return
        told.append(list(dict.fromkeys(trial.variant for trial in todo)))
        raise KeyboardInterrupt
        yield

    monkeypatch.setattr(run_demo, "results_of", noted)
    for names in ("dynamic-ml, odometry", "plain"):
        main.status(["demo", "--out", str(tmp_path), "--variants", names])
    assert told[0] == ["dynamic-ml", "odometry"]
    assert {"odometry", "static-ml", "dynamic-ml"} <= set(told[1])
    assert not any("/" in name for name in told[1])


def test_an_unknown_variant_is_refused(tmp_path, capsys):
    assert main.status(["demo", "--out", str(tmp_path / "out"), "--variants", "magic"]) == 2
    assert "unknown SLAM variant 'magic'; known: all, plain, odometry, s" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_the_table_by_hand():
    rows = [result("a", seed, ate) for seed, ate in enumerate((0.01, 0.02, 0.5))]
    (row,) = summary(rows)
    assert (row.ate_mm.value, row.ate_mm.low, row.ate_mm.high) == pytest.approx((20, 10, 500))
    assert row.failed_percent.value == pytest.approx(100 / 3)
    assert row.heading_deg.value == pytest.approx(math.degrees(0.1))
    assert math.isnan(row.brier.value)
    assert "| 20 (10 to 500) |" in markdown(rows)


def test_the_bound_is_a_row_of_its_own_each_episode_counted_once():
    rows = [
        result(variant, seed, 0.02, doors=doors, ate_bound=bound)
        for variant in "ab"
        for doors, bounds in {"static": (0.001, 0.002, 0.006), "moving": (0.004, 0.004)}.items()
        for seed, bound in enumerate(bounds)
    ]
    rows.append(result("c", 9, 0.02, ate_bound=None))
    *_, static, moving = summary(rows)
    assert (static.variant, static.doors, moving.doors) == ("bound", "static", "moving")
    assert static.ate_mm == pytest.approx((2, 1, 6))
    assert moving.ate_mm == pytest.approx((4, 4, 4))
    assert "| bound | moving | 4.0 (4.0 to 4.0) | - | - | - | - | - |" in markdown(rows)


def test_the_table_for_a_terminal_shows_what_is_unknown_as_a_dash():
    shown = io.StringIO()
    Console(file=shown, width=80).print(terminal([result("a", 0, 0.01, ate_bound=0.004)], ""))
    line = next(line for line in shown.getvalue().splitlines() if "bound " in line)
    assert line.split() == ["bound", "moving", "4.0", "(4.0-4.0)", *"-----"]


def test_the_comparison_pairs_by_seed():
    rows = [result("a", seed, 0.02 + 0.001 * seed) for seed in range(6)]
    rows += [result("b", seed, 0.01 + 0.001 * seed) for seed in reversed(range(7))]
    ate, f1 = comparison(rows, VariantCase("a", "moving"), VariantCase("b", "moving"))
    assert ate == "ATE +10.0 mm (+10.0 to +10.0), p = 0.031"
    assert f1.startswith("F1 +0.000")


def test_too_few_pairs_are_told_as_such():
    rows = [result(name, seed, 0.1) for name in "ab" for seed in range(MIN_PAIRS - 1)]
    ate, _ = comparison(rows, VariantCase("a", "moving"), VariantCase("b", "moving"))
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
    assert "bound" not in text


def test_findings_tell_how_many_bounds_the_error_is():
    rows = [
        result("static-ml", seed, ate, ate_bound=0.005) for seed, ate in enumerate((0.01, 0.02))
    ]
    rows += [result("dynamic-ml", 0, 0.03, doors="static", ate_bound=0.01)]
    told = findings(rows).splitlines()
    assert told[-3:] == [
        "ATE, in Cramer-Rao bounds of one scan in the true map:",
        "  static-ml, moving doors: 3.0 (2.0 to 4.0)",
        "  dynamic-ml, static doors: 3.0 (3.0 to 3.0)",
    ]
