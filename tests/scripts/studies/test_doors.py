# pyright: reportMissingImports=false
from pathlib import Path

import pytest
from dynslam_cli.studies.door_study import drive, reliability, table


@pytest.fixture(scope="module")
def rows() -> list[dict]:
    return drive("corridor", "moving", 1000) + drive("corridor", "static", 1000)


def test_most_doors_are_found_and_what_is_found_is_a_door(rows: list[dict]) -> None:
    moving, static = rows
    assert [state for state, _ in moving["doors"]] == ["both"] * 8
    assert sum(p >= 0.9 for _, p in moving["doors"]) >= 7
    assert {state for state, _ in static["doors"]} == {"open", "closed"}
    assert sum(p >= 0.5 for _, p in static["doors"]) >= 4  # by shape alone
    assert not any(moved for _, _, moved in static["found"])
    assert all(right for row in rows for p, right, _ in row["found"] if p >= 0.9)


def test_the_table_and_the_diagram(rows: list[dict], tmp_path: Path) -> None:
    wrong = {"world": "loop", "law": "static", "seed": 0, "failed": False,
             "found": [[0.95, False, False]], "doors": [["open", 0.0]]}  # fmt: skip
    text = table([*rows, wrong])
    assert "| seen open and closed | " in text
    shut = sum(state == "closed" for state, _ in rows[1]["doors"])
    assert f" of {shut} (" in text
    right = sum(p >= 0.9 and not moved for row in rows for p, _, moved in row["found"])
    assert f"by shape alone: right {right} of {right + 1} (" in text
    assert "ATE" not in text
    whole, good = table([*rows, {**wrong, "failed": True}]).split("ATE is above 0.3 m (1 of 3)")
    assert f"by shape alone: right {right} of {right + 1} (" in whole
    assert f"by shape alone: right {right} of {right} (" in good
    reliability([*rows, wrong], tmp_path / "reliability.png")
    assert (tmp_path / "reliability.png").stat().st_size > 5000
