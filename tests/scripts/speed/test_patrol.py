# pyright: reportMissingImports=false
"""Where the time of a patrol's step goes."""

import pytest
from dynslam_cli.speed import patrol as speed_patrol
from dynslam_cli.speed.patrol import PARTS, patrol_rows, patrol_table


def test_the_parts_are_the_whole(monkeypatch):
    monkeypatch.setattr(speed_patrol, "STEPS_PER_ROUND", 2)
    monkeypatch.setattr(speed_patrol, "WORLDS", 2)
    monkeypatch.setattr(speed_patrol, "find_spec", lambda name: None)  # what is not installed
    methods = [getattr(owner, method) for _, owner, method in PARTS]
    rows = patrol_rows(1, lambda items, description: items)
    parts, whole = rows[:-1], rows[-1]["step_us"]
    assert len(parts) == len(PARTS) + 1
    assert all(row["step_us"] > 0 for row in parts)
    assert sum(row["step_us"] for row in parts) == pytest.approx(whole)
    assert sum(row["share"] for row in parts) == pytest.approx(1.0)
    assert [getattr(owner, method) for _, owner, method in PARTS] == methods  # as they were
    assert patrol_table(rows).row_count == len(rows)
