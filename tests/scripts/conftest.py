# pyright: reportMissingImports=false
"""A small log of our own making; a small bench, which caches episodes in a folder of the tests."""

from pathlib import Path

import pytest
from dynslam_cli import main
from dynslam_cli.bench import run_bench

from agents import record_corridor
from slam.episode import Episode
from slam.io.carmen.writer import write_carmen

SCANS = 80


@pytest.fixture(scope="session")
def short_episode() -> Episode:
    """The first seconds of a simulated drive."""
    drive = record_corridor(3, "moving")
    return Episode(drive.scans[:SCANS], drive.odometry, meta=drive.meta)


@pytest.fixture
def log(tmp_path: Path, short_episode: Episode) -> Path:
    path = tmp_path / "drive.log"
    write_carmen(short_episode, path)
    return path


@pytest.fixture(scope="session", autouse=True)
def cache_folder(tmp_path_factory: pytest.TempPathFactory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("DYNSLAM_CACHE", str(tmp_path_factory.mktemp("episodes")))
        yield


@pytest.fixture
def bench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Runs `dynslam bench ARGUMENTS` into a folder, and gives its exit status; the report, which
    takes longer than the runs, is written on request."""

    def run(*arguments: str, out: Path = tmp_path / "out", report: bool = False) -> int:
        if not report:
            monkeypatch.setattr(run_bench, "write_report", lambda rows, out, order: iter(()))
        return main.status(["bench", *arguments, "--out", str(out)])

    return run
