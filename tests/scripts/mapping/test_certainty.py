# pyright: reportMissingImports=false
"""A run that was not sure where the robot was says so, and exits with status 3."""

import json
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from dynslam_cli import main
from dynslam_cli.figures.style import LOST
from dynslam_cli.mapping import map_export, map_recording
from dynslam_cli.mapping.certainty import Certainty
from PIL import Image, ImageColor, ImageSequence

from slam.algorithms.dead_reckoning import DeadReckoning
from slam.algorithms.maximum_likelihood import MaximumLikelihood
from slam.geometry import Pose2
from slam.interface import Estimate
from slam.io.tum import read_tum
from slam.scan import Scan

SCANS = 80  # of the log


@pytest.mark.parametrize(
    ("lost", "status", "told"),
    [
        ([0.0, 0.1, 0.4], 0, ()),
        ([], 0, ()),
        ([0.0] * 8 + [0.9, 0.1], 0, ("at 10 % of the scans, and found again",)),
        ([0.0] * 9 + [0.9], 3, ("at the end",)),
        ([0.9] * 3 + [0.0] * 7, 3, ("at 30 % of the scans",)),
    ],
)
def test_lost_at_the_end_or_for_long_is_not_sure(lost, status: int, told: tuple[str, ...]):
    certainty = Certainty(np.arange(len(lost)), np.array(lost), np.zeros(len(lost)))
    assert certainty.status == status
    assert len(certainty.warnings) == len(told)
    assert all(part in said for part, said in zip(told, certainty.warnings, strict=True))


@pytest.mark.parametrize(
    ("distances", "told"),
    [
        ([0.45], "moved by 0.45 m at 1.50 s: what"),
        ([0.45, 0.3], "moved by 0.45 m at 1.50 s, 0.30 m at 3.00 s: what"),
        ([0.4] * 4, "0.40 m at 4.50 s, and once more: what"),
        ([0.4] * 5, "0.40 m at 4.50 s, and 2 times more: what"),
    ],
)
def test_drifts_that_were_taken_out_of_the_pose_are_told(distances: list[float], told: str):
    drift = np.zeros(10)
    drift[1 : len(distances) + 1] = distances
    certainty = Certainty(1.5 * np.arange(10), np.zeros(10), drift)
    (warning,) = certainty.warnings
    assert told in warning
    assert certainty.sure
    first = {"time": 1.5, "distance": distances[0]}
    assert certainty.as_dict()["drifts"][0] == first
    assert len(certainty.as_dict()["drifts"]) == len(distances)


@pytest.mark.parametrize("command", ["map", "run"])
def test_a_drift_of_a_run_is_told_in_the_terminal_and_in_its_summary(
    command: str, log: Path, tmp_path: Path, monkeypatch, capsys
):
    update = MaximumLikelihood.update
    updates: Counter[MaximumLikelihood] = Counter()

    def drifting(self: MaximumLikelihood, displacement: Pose2, scan: Scan) -> Estimate:
        updates[self] += 1
        return update(self, displacement, scan)._replace(drift=0.4 * (updates[self] == 20))

    monkeypatch.setattr(MaximumLikelihood, "update", drifting)
    out = tmp_path / "out"
    skip = ["--skip", "rrd,mcap"] if command == "map" else []
    status = main.status([command, str(log), "--slam", "static-ml", "--out", str(out), *skip])
    time = read_tum(out / "trajectory.tum").times[19]
    assert status == 0
    assert "warning: the map had drifted" in capsys.readouterr().err
    told = json.loads(
        (out / ("summary" if command == "map" else "metrics")).with_suffix(".json").read_text()
    )
    assert told["drifts"] == [{"time": pytest.approx(time), "distance": 0.4}]


@pytest.mark.parametrize("command", ["map", "run"])
def test_a_lost_robot_is_told_and_exits_with_status_3(
    command: str, log: Path, tmp_path: Path, monkeypatch, capsys
):
    update = MaximumLikelihood.update
    monkeypatch.setattr(
        MaximumLikelihood, "update", lambda *given: update(*given)._replace(lost=0.8)
    )
    skip = ["--skip", "rrd,mcap"] if command == "map" else []
    arguments = [command, str(log), "--slam", "static-ml", "--out", str(tmp_path / "out"), "--json"]
    assert main.status([*arguments, *skip]) == 3
    out, err = capsys.readouterr()
    told = json.loads(out.splitlines()[-1])
    assert "lost at the end" in told["warnings"][-1]
    assert (told["lost_at_end"], told["lost_share"]) == (0.8, 1.0)
    assert f"{log}: warning: the robot was lost at the end" in err
    assert (tmp_path / "out" / "trajectory.tum").exists()


@pytest.mark.parametrize("command", ["map", "run"])
@pytest.mark.parametrize(("lost", "judged"), [((0.2, 0.75), True), ((0.0, 0.0), False)])
def test_files_and_pictures_show_where_it_was_lost(
    command: str, lost: tuple[float, float], judged: bool, log: Path, tmp_path: Path, monkeypatch
):
    update = DeadReckoning.update
    probabilities = np.where(np.arange(SCANS) // 10 == 3, lost[1], lost[0])
    updates: Counter[DeadReckoning] = Counter()

    def judging(self: DeadReckoning, displacement: Pose2, scan: Scan) -> Estimate:
        updates[self] += 1
        return update(self, displacement, scan)._replace(lost=probabilities[updates[self] - 1])

    monkeypatch.setattr(DeadReckoning, "update", judging)
    monkeypatch.setattr(map_recording, "SNAPSHOTS", {"film": 10})
    monkeypatch.setattr(map_export, "suffix", lambda: ".gif")
    out = tmp_path / "out"
    skip = ["--skip", "rrd,mcap", "--film"] if command == "map" else []
    assert main.status([command, str(log), "--slam", "odometry", "--out", str(out), *skip]) == 0
    assert (out / "lost.csv").exists() == judged
    pictures = [out / "map.png", *out.glob("film.gif")]
    assert len(pictures) == (2 if command == "map" else 1)
    assert all((marked(path) > 100) == judged for path in pictures)
    if judged:
        assert (out / "lost.csv").read_text().startswith("time,lost\n")
        times, written = np.loadtxt(out / "lost.csv", delimiter=",", skiprows=1).T
        np.testing.assert_array_equal(times, read_tum(out / "trajectory.tum").times)
        np.testing.assert_array_equal(written, probabilities)
    if command == "map":
        assert ("lost.csv" in json.loads((out / "summary.json").read_text())["files"]) == judged


def marked(path: Path) -> int:
    """Pixels in the colour of a lost robot, in all frames."""
    with Image.open(path) as image:
        frames = [np.asarray(one.convert("RGB")) for one in ImageSequence.Iterator(image)]
    return int((np.array(frames) == ImageColor.getrgb(LOST)).all(axis=-1).sum())
