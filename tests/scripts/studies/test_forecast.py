# pyright: reportMissingImports=false
"""`dynslam forecast`, and the plain baselines: right on doors whose law is known."""

import json
from pathlib import Path

import numpy as np
import pytest
from dynslam_cli.main import status
from dynslam_cli.studies import door_baselines
from dynslam_cli.studies.door_minutes import between, looks, minutes_of
from dynslam_cli.studies.forecast_study import HORIZONS, OURS, OURS_SINCE
from PIL import Image

from slam import load_forecast
from slam.forecast.watched import Runs
from slam.io.door_runs import HEADER
from tests.slam.forecast.habits import DAY, HOUR, MONDAY, WEEK, chain, office, runs_of


def written(path: Path, runs: Runs) -> Path:
    rows = zip(*(part.tolist() for part in runs), strict=True)
    path.write_text("\n".join([HEADER, *(f"{b:.0f},{e:.0f},{s}" for b, e, s in rows)]) + "\n")
    return path


@pytest.fixture
def door(tmp_path: Path) -> Path:
    """Seven weeks of an office whose door is opened and shut at random within its hours."""
    states = office(7)
    return written(tmp_path / "door.csv", runs_of(states * chain(len(states), 0.1, 0.03, 4)))


def test_ours_is_best_after_some_minutes_and_never_far_from_it(
    door: Path, tmp_path: Path, capsys
) -> None:
    out = tmp_path / "out"
    assert status(["forecast", str(door), "--out", str(out)]) == 0
    scores = json.loads((out / "scores.json").read_text())
    for horizon in map(str, HORIZONS):
        brier = {name: np.mean(s[horizon]["brier"]) for name, s in scores.items() if horizon in s}
        best = min(value for name, value in brier.items() if name not in (OURS, OURS_SINCE))
        assert brier[OURS] < (0.9 * best if horizon == "5" else best + 3e-3)
    assert len(scores[OURS]["1"]["brier"]) == 2
    assert "FreMEn" in (out / "table.md").read_text()
    assert "persistence" in capsys.readouterr().out
    assert load_forecast(out / "door.npz").probability(MONDAY + 13 * HOUR) > 0.6
    assert Image.open(out / "week.png").width > 1000


def test_weeks_named_are_forecast(door: Path, tmp_path: Path) -> None:
    week = written(tmp_path / "week.csv", runs_of(office(1), MONDAY + 8 * WEEK))
    assert status(["forecast", str(door), str(week), "--out", str(tmp_path / "out")]) == 0
    scores = json.loads((tmp_path / "out" / "scores.json").read_text())
    assert len(scores[OURS]["0"]["brier"]) == 1


@pytest.mark.parametrize(
    ("states", "message"),
    [(office(3), "no week after the first 5"), (0 * office(7), "must have both states")],
)
def test_a_history_that_is_too_little_is_told(states, message: str, tmp_path: Path, capsys) -> None:
    door = written(tmp_path / "door.csv", runs_of(states))
    assert status(["forecast", str(door), "--out", str(tmp_path / "out")]) == 2
    assert message in capsys.readouterr().err


def test_minutes_of_runs() -> None:
    runs = Runs(np.array([0.0, 90.0, 600.0]), np.array([90.0, 200.0, 660.0]), np.array([0, 1, 1]))
    minutes = minutes_of(runs)
    assert minutes.minute.tolist() == [0, 1, 2, 3, 10]
    assert minutes.state.tolist() == [0, 0, 1, 1, 1]
    assert minutes.since.tolist()[2:4] == [90.0, 90.0]
    assert np.isnan(minutes.since[[0, 1, 4]]).all()
    pairs = looks(minutes, 2)
    assert (pairs.now.tolist(), pairs.look.tolist()) == ([2, 3], [0, 1])
    assert [part.tolist() for part in between(runs, 60.0, 95.0)] == [[60, 90], [90, 95], [0, 1]]


def test_the_baselines_know_their_laws() -> None:
    minutes = minutes_of(runs_of(office(4)))
    pairs = looks(minutes, 0)
    for learn, error in ((door_baselines.hour_of_week, 1e-3), (door_baselines.fremen, 0.05)):
        told = learn(minutes)(minutes, pairs, 0)
        assert np.mean((told - minutes.state) ** 2) < error
    hours = door_baselines.hour_of_day(minutes)(minutes, pairs, 0)
    assert hours[13 * 60] == pytest.approx(5 / 7, abs=1e-2)
    assert door_baselines.mean_rate(minutes)(minutes, pairs, 0)[0] == pytest.approx(40 / 168)
    restless = minutes_of(runs_of(chain(int(30 * DAY / 60), 0.02, 0.06, seed=5)))
    pairs = looks(restless, 10)
    told = door_baselines.markov_chain(restless)(restless, pairs, 10)
    after_one = told[restless.state[pairs.look] == 1][0]
    assert after_one == pytest.approx(0.25 + 0.75 * 0.92**10, abs=0.03)
    assert set(door_baselines.persistence(restless)(restless, pairs, 10).tolist()) == {0.0, 1.0}
