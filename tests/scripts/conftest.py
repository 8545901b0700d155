# pyright: reportMissingImports=false
"""A small log of our own making; a small bench, which caches episodes in a folder of the tests."""

import shutil
import sys
from pathlib import Path

import gymnasium as gym
import pytest
from dynslam_cli import main
from dynslam_cli.bench import run_bench

from agents import record_corridor
from slam.episode import Episode
from slam.io.carmen.writer import write_carmen
from tests.browser import chromium
from tests.one_process import made_once

from .results import SMALL

SCANS = 80


@pytest.fixture(scope="session")
def short_episode() -> Episode:
    """The first seconds of a simulated drive."""
    drive = record_corridor(3, "moving")
    return Episode(drive.scans[:SCANS], drive.odometry, meta=drive.meta)


OWN_IDS = """
import gymnasium as gym

from dynslam_env import Corridor

gym.register(
    id="OwnWorld-v0",
    entry_point="dynslam_env.env:DoorWorldEnv",
    max_episode_steps=150,
    kwargs={"world": Corridor(length=7.0)},
)
gym.register(
    id="OwnPatrol-v0",
    entry_point="dynslam_env.patrol.env:DoorPatrolEnv",
    vector_entry_point="dynslam_env.patrol.vector:DoorPatrolVectorEnv",
    max_episode_steps=20,
)
"""


@pytest.fixture
def own_ids(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """A module that registers a world and a patrol, as a user's package does."""
    (tmp_path / "own_ids.py").write_text(OWN_IDS)
    monkeypatch.syspath_prepend(tmp_path)
    yield
    sys.modules.pop("own_ids", None)
    for name in ("OwnWorld-v0", "OwnPatrol-v0"):
        gym.registry.pop(name, None)


@pytest.fixture(scope="module")
def browser():
    with chromium() as opened:
        yield opened


@pytest.fixture
def log(tmp_path: Path, short_episode: Episode) -> Path:
    path = tmp_path / "drive.log"
    write_carmen(short_episode, path)
    return path


@pytest.fixture(scope="session", autouse=True)
def cache_folder(tmp_path_factory: pytest.TempPathFactory):
    with pytest.MonkeyPatch.context() as patch:
        folder = made_once(tmp_path_factory, "episodes", lambda empty: None)
        patch.setenv("DYNSLAM_CACHE", str(folder))
        yield


@pytest.fixture(scope="session")
def small_results(cache_folder, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The results of SMALL, without a report."""

    def bench(out: Path) -> None:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(run_bench, "write_report", lambda rows, out, order: iter(()))
            assert main.status(["bench", *SMALL, "--jobs", "2", "--out", str(out)]) == 0

    return made_once(tmp_path_factory, "small", bench)


@pytest.fixture
def small(small_results: Path, tmp_path: Path) -> Path:
    """A copy of them, where `bench` writes to."""
    return Path(shutil.copytree(small_results, tmp_path / "out"))


@pytest.fixture
def bench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Runs `dynslam bench ARGUMENTS` into a folder, and gives its exit status; the report, which
    takes longer than the runs, is written on request. One job at a time unless told otherwise:
    to start a process takes longer than most runs."""

    def run(*arguments: str, out: Path = tmp_path / "out", report: bool = False) -> int:
        if not report:
            monkeypatch.setattr(run_bench, "write_report", lambda rows, out, order: iter(()))
        jobs = () if "--jobs" in arguments else ("--jobs", "1")
        return main.status(["bench", *arguments, *jobs, "--out", str(out)])

    return run
