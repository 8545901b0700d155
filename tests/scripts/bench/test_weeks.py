# pyright: reportMissingImports=false
"""`dynslam bench weeks`: a small campaign is run, and the table compares whole campaigns."""

import json
from dataclasses import replace

import numpy as np
import pytest
from dynslam_cli.bench import weeks
from dynslam_cli.bench.weeks import Building, WeeksTrial, visit_scores
from dynslam_cli.bench.weeks_table import markdown, weeks_tables
from dynslam_cli.main import status
from dynslam_cli.trials.results import read_rows

from agents import record_corridor
from slam.episode import Episode
from slam.geometry import Pose2
from slam.grid import OccupancyGrid
from slam.layers import layers
from slam.sessions.session import Session
from slam.sessions.static_layer import of_what_stands


@pytest.fixture(scope="module")
def drive() -> Episode:
    return record_corridor(7, max_episode_steps=200)


@pytest.fixture
def short(monkeypatch):
    monkeypatch.setattr(weeks, "MAPPED", (0,))
    monkeypatch.setattr(weeks, "LATER", (1, 2))


@pytest.mark.parametrize("variant", ["static-ml", "layers"])
def test_a_campaign_is_scored(short, variant: str):
    row = WeeksTrial("DoorCorridor-v0", variant, 7)().row
    assert row["error"] is None
    assert row["world"] == "corridor"
    for way in ("frozen", "living"):
        shares = [row[f"{way}_{name}"] for name in ("right", "wrong", "unplaced")]
        assert sum(shares) == pytest.approx(1.0)
        assert row[f"{way}_right"] == 1.0
        assert row[f"{way}_off"] < 0.1
        assert row[f"{way}_ate"] < 0.05
        assert 0.6 < row[f"{way}_f1"] <= 1.0
        assert 0.0 < row[f"{way}_brier"] < 0.2
    json.dumps(row, allow_nan=False)


def test_a_failure_is_a_result():
    row = WeeksTrial("DoorCorridor-v0", "odometry", 7)().row
    assert "continued by a variant" in row["error"]


def test_a_visit_that_is_placed_wrongly_or_not_at_all_is_told(drive):
    building = Building("static-ml", 0)
    done = building.visit(drive)
    assert done is not None
    made, start = done
    assert building.grid is not None
    assert visit_scores(drive, done, building.grid)["right"] == 1.0
    none = visit_scores(drive, None, building.grid)
    assert (none["unplaced"], none["right"], none["off"], none["ate"]) == (1.0, 0.0, 1.0, None)
    off = made.online + (1.0, 0.0, 0.0)
    moved = replace(made, poses=off, online=off)
    wrong = visit_scores(drive, (moved, start @ Pose2(1.0, 0.0, 0.0)), building.grid)
    assert (wrong["wrong"], wrong["off"], wrong["ate"]) == (1.0, 1.0, None)


def test_what_changes_is_left_out_of_the_static_layer(drive):
    truth = drive.truth
    known = Session(drive.scans, truth.poses)
    made = layers(known.scans, known.poses)
    standing = of_what_stands(known, made)
    gone = [np.isnan(a.ranges) & ~np.isnan(b.ranges)
            for a, b in zip(standing.scans, known.scans, strict=True)]  # fmt: skip
    assert 0 < np.mean(gone) < 0.2
    again = layers(standing.scans, standing.poses)
    assert again.changing.sum() < 0.2 * made.changing.sum()
    assert isinstance(made.static_map(), OccupancyGrid)


def row(variant: str, seed: int, off: float, **more) -> dict:
    scores = {"right": 1.0, "wrong": 0.0, "unplaced": 0.0, "off": off, "ate": 0.01, "f1": 0.9,
              "brier": 0.1, "ghosts": 1.0}  # fmt: skip
    both = {
        f"{way}_{name}": value for way in ("frozen", "living") for name, value in scores.items()
    }
    costs = {"map_bytes": 1e6, "seconds": 9.0}
    base = {"variant": variant, "seed": seed, "world": "corridor", "error": None}
    return {**base, **both, **costs, **more}


def test_the_table_compares_whole_campaigns():
    rows = [row("a-ml", k, 0.10 + 0.001 * k) for k in range(12)]
    rows += [row("b-ml", k, 0.02 + 0.0015 * k, frozen_ate=None) for k in range(11)]
    rows.append(row("b-ml", 11, 0.0, error="died"))
    text = markdown(weeks_tables(rows, ["a-ml", "b-ml"]))
    assert text.startswith("corridor, frozen map: 11 campaigns\n")
    frozen = next(line for line in text.splitlines() if line.startswith("| `b-ml`"))
    cells = [cell.strip() for cell in frozen.split("|")[2:-1]]
    assert cells == ["100.0", "0.0", "0.0", "2.75*", "inf*", "0.900", "0.1000", "1.00"]
    assert "no campaign was finished" in weeks_tables(rows, ["a-ml", "c-ml"])[0].title


def test_the_page_has_the_calendar_of_each_door(short, tmp_path, capsys):
    options = ["--variants", "static-ml", "--seeds", "1", "--first", "7", "--jobs", "1"]
    out = ["--worlds", "corridor", "--out", str(tmp_path)]
    assert status(["bench", "weeks", *options, *out]) == 0
    assert "| `static-ml` | 100.0" in capsys.readouterr().out
    page = (tmp_path / "report.html").read_text()
    assert "Doors of corridor, campaign 7, as static-ml remembers" in page
    assert page.count("data:image/png;base64,") == 1
    (result,) = read_rows(tmp_path / "results.jsonl")
    assert len(result["weeks"]) == 8


def test_what_cannot_be_is_told(tmp_path, capsys):
    out = ["--out", str(tmp_path)]
    assert status(["bench", "weeks", "--variants", "odometry", *out]) == 2
    assert "continued by a variant" in capsys.readouterr().err
    assert status(["bench", "weeks", "--cluster", "tcp://nowhere:1", *out]) == 2
    assert "--cluster" in capsys.readouterr().err
    assert status(["bench", "weeks", "--worlds", "loop", *out]) == 2
    assert "corridor, office" in capsys.readouterr().err
    assert status(["bench", "paper", "--worlds", "corridor", *out]) == 2
    assert "suite `weeks`" in capsys.readouterr().err
