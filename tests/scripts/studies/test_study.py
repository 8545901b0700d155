# pyright: reportMissingImports=false
import json
from pathlib import Path

import numpy as np
import pytest
from dynslam_cli.main import status
from dynslam_cli.studies.cases import STUDIES
from dynslam_cli.studies.study_runs import consistency, table

ROW = {
    "f1_5cm": 0.9, "brier_share_door": None, "nees": 3.0, "within": 0.95, "failed": False,
    "ms": 0.5, "env": "DoorCorridor-v0", "ate_online": 0.01, "rms_along": 0.01, "rms_across": 0.02,
}  # fmt: skip


def test_a_study_end_to_end(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    assert status(["study", "windows", "--seeds", "1", "--jobs", "1", "--out", str(out)]) == 0
    rows = [json.loads(line) for line in (out / "results.jsonl").read_text().splitlines()]
    assert [row["case"] for row in rows] == [case.name for case in STUDIES["windows"]()]
    assert all(0 < row["ate"] < 0.3 and 0 < row["nees"] < 100 for row in rows)
    text = (out / "table.md").read_text()
    assert len(text.splitlines()) == 2 + len(rows)
    assert "delta_t 16 s" in capsys.readouterr().out


def test_unknown_studies_are_told(capsys: pytest.CaptureFixture[str]) -> None:
    assert status(["study", "nonsense"]) == 2
    assert "accuracy" in capsys.readouterr().err


def test_no_two_cases_of_a_study_have_one_name() -> None:
    for cases in STUDIES.values():
        names = [(case.name, case.doors) for case in cases()]
        assert len(set(names)) == len(names)


def test_of_errors_as_large_as_claimed_nees_is_three_and_95_percent_are_within() -> None:
    rng = np.random.default_rng(0)
    covariance = np.array([[0.04, 0.01, 0.0], [0.01, 0.09, 0.002], [0.0, 0.002, 0.01]])
    errors = rng.multivariate_normal(np.zeros(3), covariance, 20_000)
    found = consistency(errors, np.tile(covariance, (20_000, 1, 1)))
    assert found["nees"] == pytest.approx(3.0, rel=0.03)
    assert found["within"] == pytest.approx(0.95, abs=0.01)
    assert consistency(errors, np.zeros((20_000, 3, 3))) == {"nees": None, "within": None}


def test_differences_are_paired_with_the_first_case_of_the_same_doors_and_world() -> None:
    rows = [
        ROW | {"case": case + env, "env": env, "doors": doors, "seed": seed, "ate": ate + more}
        for case, more in (("a", 0.0), ("b", 0.002))
        for doors, env in (("never", "one"), ("often", "one"), ("often", "two"))
        for seed, ate in enumerate(np.linspace(0.01, 0.08, 8) * (1 + (env == "two")))
    ]
    lines = table(rows).splitlines()[2:]
    assert [line.split(" | ")[5] for line in lines[:3]] == ["-", "-", "-"]
    assert all(line.split(" | ")[5].startswith("+2.0 (+2.0 to +2.0), p ") for line in lines[3:])
