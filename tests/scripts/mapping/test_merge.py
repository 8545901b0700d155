# pyright: reportMissingImports=false
"""`dynslam merge`: one map of two, or a clear line."""

import json
from pathlib import Path

import numpy as np
import pytest
from dynslam_cli import main

from slam.io.ros_map import read_ros_map
from slam.sessions.session import Session
from tests.slam.sessions.test_merging import bent, drive, part


@pytest.fixture
def parts(tmp_path: Path) -> list[str]:
    whole = drive(alike=False)
    for name, session in ("a", part(whole, 0, 140)), ("b", bent(part(whole, 60, 250, 1000.0), 0.0)):
        session.save(tmp_path / f"{name}.npz")
    return [str(tmp_path / "a.npz"), str(tmp_path / "b.npz")]


def test_two_maps_become_one_that_can_be_continued(parts, tmp_path: Path, capfd) -> None:
    out = tmp_path / "both"
    assert main.status(["merge", *parts, "--out", str(out), "--json"]) == 0
    told = capfd.readouterr().out.splitlines()
    assert "stretches of its path" in told[0]
    assert "at any other place at most" in told[0]
    summary = json.loads(told[-1])
    assert summary == json.loads((out / "summary.json").read_text())
    assert sorted(summary["files"]) == sorted(path.name for path in out.iterdir())
    both = Session.load(out / "session.npz")
    assert np.bincount(both.recordings).tolist() == [140, 190]
    cells = read_ros_map(out / "map.yaml")
    assert cells.sample(np.array([[0.0, 3.0], [16.0, 8.0]]))[1].all()  # seen by one map each


def test_maps_that_do_not_overlap_end_with_one_line(parts, tmp_path: Path, capfd) -> None:
    part(drive(alike=False), 0, 30).save(tmp_path / "short.npz")
    out = tmp_path / "none"
    arguments = ["merge", str(tmp_path / "short.npz"), parts[1], "--out", str(out)]
    assert main.status(arguments) == 2
    assert "do not overlap enough" in capfd.readouterr().err.splitlines()[-1]
    assert not list(out.iterdir())
    assert main.status([*arguments, "--at", "0", "nan", "0"]) == 2
    assert "--at is three finite numbers" in capfd.readouterr().err
