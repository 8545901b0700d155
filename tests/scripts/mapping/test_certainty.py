# pyright: reportMissingImports=false
"""A run that was not sure where the robot was says so, and exits with status 3."""

import json
from pathlib import Path

import numpy as np
import pytest
from dynslam_cli import main
from dynslam_cli.mapping.certainty import Certainty

from slam.algorithms.maximum_likelihood import MaximumLikelihood


@pytest.mark.parametrize(
    ("lost", "status", "told"),
    [
        ([0.0, 0.1, 0.4], 0, ()),
        ([], 0, ()),
        ([0.0] * 8 + [0.9, 0.1], 0, ()),
        ([0.0] * 9 + [0.9], 3, ("at the end",)),
        ([0.9] * 3 + [0.0] * 7, 3, ("at 30 % of the scans",)),
    ],
)
def test_lost_at_the_end_or_for_long_is_not_sure(lost, status: int, told: tuple[str, ...]):
    certainty = Certainty(np.array(lost))
    assert certainty.status == status
    assert len(certainty.warnings) == len(told)
    assert all(part in said for part, said in zip(told, certainty.warnings, strict=True))


@pytest.mark.parametrize("command", ["map", "run"])
def test_a_lost_robot_is_told_and_exits_with_status_3(
    command: str, log: Path, tmp_path: Path, monkeypatch, capsys
):
    update = MaximumLikelihood.update
    monkeypatch.setattr(
        MaximumLikelihood, "update", lambda *given: update(*given)._replace(lost=0.8)
    )
    skip = ["--skip", "film,rrd,mcap"] if command == "map" else []
    arguments = [command, str(log), "--slam", "static-ml", "--out", str(tmp_path / "out"), "--json"]
    assert main.status([*arguments, *skip]) == 3
    out, err = capsys.readouterr()
    told = json.loads(out.splitlines()[-1])
    assert "lost at the end" in told["warnings"][-1]
    assert (told["lost_at_end"], told["lost_share"]) == (0.8, 1.0)
    assert f"{log}: warning: the robot was lost at the end" in err
    assert (tmp_path / "out" / "trajectory.tum").exists()
