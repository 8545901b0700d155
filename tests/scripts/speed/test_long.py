# pyright: reportMissingImports=false
import math
from itertools import pairwise

import numpy as np
import pytest
from dynslam_cli.speed import long
from dynslam_cli.speed.long import LAP, Step, long_rows, long_table, world
from rich.console import Console

from dynslam_env import Loop
from slam.geometry import Pose2


def untracked(items, description):
    return items


@pytest.fixture(scope="module")
def driven() -> list[Step]:
    return list(world(60))


def test_a_lap_is_as_long_as_its_path():
    path = Loop().layout(np.random.default_rng(0)).path
    assert np.hypot(*np.diff(path, axis=0).T).sum() == pytest.approx(LAP)


def test_the_drive_is_scan_by_scan_with_fresh_noise(driven):
    assert len(driven) == 60
    assert driven[0].displacement == Pose2()
    assert len({id(step.scan.angles) for step in driven}) == 1
    times = [step.scan.time for step in driven]
    assert np.diff(times) == pytest.approx(0.1)
    assert math.dist(driven[0].truth[:2], driven[-1].truth[:2]) > 1.0
    moved = [a.truth.between(b.truth) for a, b in pairwise(driven)]
    errors = [tuple(m.between(s.displacement)) for m, s in zip(moved, driven[1:], strict=True)]
    assert len(set(errors)) > 50
    assert np.abs(errors).max() < 0.2


def test_the_same_drive_is_driven_again(driven):
    again = list(world(20))
    for one, other in zip(again, driven, strict=False):
        assert (one.displacement, one.truth) == (other.displacement, other.truth)
        np.testing.assert_array_equal(one.scan.ranges, other.scan.ranges)


def test_a_row_for_each_variant(monkeypatch):
    monkeypatch.setattr(long, "WARM_UP_SCANS", 3)
    rows = long_rows(["odometry", "static-graph"], 60, untracked)
    odometry, graph = rows
    for row in rows:
        assert row["scans"] == 60
        for part in ("cpu_ms", "cpu_ms_99", "mb", "error_mm"):
            assert len(row[part]) == 5
        assert min(row["cpu_ms"]) > 0
        assert 0.02 < row["laps"] < 0.1
    assert (odometry["kept"], odometry["begun"]) == (None, None)
    assert (graph["kept"], graph["begun"]) == (1, 1)
    assert graph["error_mm"][-1] < 30.0 < odometry["error_mm"][-1]
    console = Console(width=100, record=True, file=None)
    console.print(long_table(rows))
    printed = console.export_text()
    assert "60 scans in 0 laps" in printed
    assert "1 of 1" in printed
