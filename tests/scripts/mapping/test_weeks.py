# pyright: reportMissingImports=false
"""`dynslam map --onto` day after day, in one folder."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from dynslam_cli import main
from dynslam_cli.mapping.weeks_picture import write_weeks

from slam.episode import Episode
from slam.forecast.door import DoorForecast
from slam.io.episode_file import save_episode
from slam.layers.doors import MappedDoor
from slam.sessions import session as session_module
from slam.sessions.session import Session
from slam.trajectory import Trajectory

MONDAY, DAY = 1767571200.0, 86400.0  # s
QUICK = ["--skip", "all", "--slam", "static-graph"]


def on_day(episode: Episode, day: int, folder: Path) -> str:
    begin = MONDAY + day * DAY
    scans = tuple(replace(scan, time=scan.time + begin) for scan in episode.scans)
    odometry = Trajectory(episode.odometry.times + begin, episode.odometry.poses)
    path = folder / f"day{day}.npz"
    save_episode(Episode(scans, odometry), path)
    return str(path)


@pytest.fixture
def house(short_episode: Episode, tmp_path: Path) -> Path:
    """A building mapped on two days, the third one without a visit."""
    out = ["--out", str(tmp_path / "house"), *QUICK]
    assert main.status(["map", on_day(short_episode, 0, tmp_path), *out]) == 0
    return tmp_path / "house"


def test_a_map_goes_on_in_its_own_folder(short_episode: Episode, house: Path, tmp_path: Path):
    onto = ["--onto", str(house / "session.npz"), "--out", str(house), *QUICK]
    for day in (1, 3):  # without a visit on the second
        assert main.status(["map", on_day(short_episode, day, tmp_path), *onto]) == 0
    known = Session.load(house / "session.npz")
    assert np.bincount(known.recordings).tolist() == [80, 80, 80]
    assert np.hypot(*(known.poses[:80] - known.poses[160:])[:, :2].T).max() < 0.1
    assert known.scans[-1].time > MONDAY + 3 * DAY


def test_an_update_that_dies_leaves_the_old_session_whole(
    short_episode: Episode, house: Path, tmp_path: Path, monkeypatch
):
    before, next_day = (house / "session.npz").read_bytes(), on_day(short_episode, 1, tmp_path)

    def torn(file, **arrays):
        file.write(before[:1000])
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(session_module.np, "savez_compressed", torn)
        onto = ["--onto", str(house / "session.npz"), "--out", str(house), *QUICK]
        assert main.status(["map", next_day, *onto]) == 130
    assert (house / "session.npz").read_bytes() == before
    assert not [path for path in house.iterdir() if path.suffix == ".tmp"]


def test_a_clock_that_was_set_back_is_told(
    short_episode: Episode, house: Path, tmp_path: Path, capsys
):
    onto = ["--onto", str(house / "session.npz"), "--out", str(tmp_path / "out"), *QUICK]
    early = on_day(short_episode, -1, tmp_path)
    assert main.status(["map", early, *onto]) == 2
    assert "was the clock set back?" in capsys.readouterr().err
    assert not (tmp_path / "out" / "session.npz").exists()
    assert main.status(["map", early, *onto, "--localise"]) == 0  # nothing is learned


def test_the_week_of_doors_that_were_seen_on_several_days_is_drawn(tmp_path: Path):
    door = MappedDoor(np.array([[0.0, 0.0], [0.9, 0.0]]), 0.5, 1, 9.0, 0, 9, 9, 9, 0.95)
    one, two = DoorForecast.fit(MONDAY, MONDAY + 3600.0, 1), DoorForecast()
    two.update([MONDAY, MONDAY + DAY], [MONDAY + 3600.0, MONDAY + DAY + 3600.0], [1, 0])
    assert write_weeks([door], [one.to_dict()], tmp_path) == []
    assert write_weeks([door, door], [one.to_dict(), two.to_dict()], tmp_path) == ["doors-week.png"]
    assert (tmp_path / "doors-week.png").stat().st_size > 5000
    assert write_weeks([door], [None], tmp_path) == []
    assert not list(tmp_path.iterdir())
    assert json.dumps(two.to_dict())
