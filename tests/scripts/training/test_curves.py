# pyright: reportMissingImports=false
"""`dynslam curves`: learning curves of several seeds."""

import json
from pathlib import Path

import pytest
from dynslam_cli.main import status
from PIL import Image


def trained(folder: Path, rows: list[tuple[int, float]]) -> str:
    """A folder that dynslam train wrote."""
    folder.mkdir()
    lines = [json.dumps({"steps": s, "reward": r, "door_brier": 0.2}) for s, r in rows]
    (folder / "progress.jsonl").write_text("\n".join(lines) + "\n")
    return str(folder)


def test_what_all_had_learned_is_told_and_drawn(tmp_path, capsys):
    folders = [trained(tmp_path / str(k), [(0, 1.0), (100, 10.0 * k)]) for k in range(1, 4)]
    assert status(["curves", *folders, "--out", str(tmp_path / "curves.png")]) == 0
    told = capsys.readouterr().out
    assert "sum of rewards after 100 steps, 3 seeds: 20.000 (10.000 to 30.000)" in told
    with Image.open(tmp_path / "curves.png") as image:
        assert min(image.size) > 300


@pytest.mark.parametrize(
    ("rows", "message"),
    [([], "no evaluations of a training"), ([(50, 1.0)], "no number of steps at which")],
)
def test_what_cannot_be_drawn_is_told(tmp_path, rows, message, capsys):
    folders = [trained(tmp_path / "a", [(0, 1.0)]), trained(tmp_path / "b", rows)]
    assert status(["curves", *folders, "--out", str(tmp_path / "curves.png")]) == 2
    assert message in capsys.readouterr().err


def test_a_folder_that_holds_none_is_told(tmp_path, capsys):
    assert status(["curves", str(tmp_path)]) == 2
    assert "progress.jsonl" in capsys.readouterr().err
