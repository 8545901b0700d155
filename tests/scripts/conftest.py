"""A small log of our own making: the first seconds of a simulated drive."""

from pathlib import Path

import pytest

from agents import record_corridor
from slam.episode import Episode
from slam.io.carmen.writer import write_carmen

SCANS = 80


@pytest.fixture(scope="session")
def short_episode() -> Episode:
    drive = record_corridor(3, "moving")
    return Episode(drive.scans[:SCANS], drive.odometry, meta=drive.meta)


@pytest.fixture
def log(tmp_path: Path, short_episode: Episode) -> Path:
    path = tmp_path / "drive.log"
    write_carmen(short_episode, path)
    return path
