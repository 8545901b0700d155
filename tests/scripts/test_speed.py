# pyright: reportMissingImports=false
import json

import pytest
from dynslam_cli import speed
from dynslam_cli.main import status


@pytest.fixture
def small(monkeypatch):
    monkeypatch.setattr(speed, "STEPS", 20)
    monkeypatch.setattr(speed, "BEAMS", (31,))
    monkeypatch.setattr(speed, "DOORS", (0, 2))
    monkeypatch.setattr(speed, "EXTRA_WALLS", (10,))


def test_it_measures_every_case_beside_its_floor(small, capsys):
    assert status(["speed", "--json", "--rounds", "2", "--num-envs", "3"]) == 0
    printed = json.loads(capsys.readouterr().out)
    rows = {row["what"]: row for row in printed["rows"]}
    assert list(rows) == [
        "one environment, gym.make",
        "one of 3, gym.make_vec",
        "one of 3, gym.make_vec, 2 threads",
        "31 beams",
        "0 doors",
        "2 doors",
        "10 more walls",
        "reset",
    ]
    for what, row in rows.items():
        assert row["step_us"] > 0
        assert row["steps_per_s"] == pytest.approx(1e6 / row["step_us"])
        assert what == "reset" or row["floor_us"] > 0
    assert "pymunk" in printed["versions"]


def test_it_prints_a_table(small, capsys):
    assert status(["speed", "--rounds", "1"]) == 0
    printed = capsys.readouterr().out
    assert "step / floor" in printed
    assert "gym.make_vec" in printed


@pytest.mark.parametrize("wrong", ["--rounds", "--num-envs"])
def test_wrong_numbers_are_refused(wrong, capsys):
    assert status(["speed", wrong, "0"]) == 2
    assert f"{wrong[2:]} must be a whole number of at least 1" in capsys.readouterr().err
