# pyright: reportMissingImports=false
"""A real Dask scheduler and two workers, each a process of its own, on loopback."""

import os
import signal
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
from dynslam_cli.trials import pool

from slam.benchmark.results import read

from ..bench.test_bench import rows_of, untimed
from ..results import SMALL

pytest.importorskip("distributed")


def dask(folder: Path, *arguments: str) -> subprocess.Popen:
    """In a group of its own, so that a worker dies with the nanny that would replace it."""
    command = [sys.executable, "-m", "dask", *arguments, "--no-dashboard"]
    log = (folder / f"{'-'.join(arguments)[:20].replace('/', '')}.txt").open("ab")
    return subprocess.Popen(command, cwd=folder, stdout=log, stderr=log, start_new_session=True)


def kill(process: subprocess.Popen) -> None:
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


@pytest.fixture
def scheduler(tmp_path):
    """The address, and a function that starts a worker."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    address, begun = f"tcp://127.0.0.1:{port}", []
    begun.append(dask(tmp_path, "scheduler", "--host", "127.0.0.1", "--port", str(port)))
    until = time.monotonic() + 60
    while time.monotonic() < until:
        try:
            socket.create_connection(("127.0.0.1", port), timeout=1).close()
            break
        except OSError:
            time.sleep(0.1)

    def worker() -> subprocess.Popen:
        begun.append(dask(tmp_path, "worker", address, "--nthreads", "1"))
        return begun[-1]

    worker.scheduler = begun[0]  # type: ignore[attr-defined]
    yield address, worker
    for process in begun:
        kill(process)


def test_a_worker_that_is_killed_on_the_way_costs_no_result(bench, scheduler, tmp_path):
    address, worker = scheduler
    first, _ = worker(), worker()
    out, killed = tmp_path / "out", threading.Event()

    def kill_one() -> None:
        path = out / "results.jsonl"
        while not path.exists() or path.read_bytes().count(b"\n") < 3:
            time.sleep(0.01)
        kill(first)
        killed.set()

    threading.Thread(target=kill_one, daemon=True).start()
    many = ("paper", "--seeds", "4", "--variants", "static-ml,dynamic-ml,odometry")
    assert bench(*many, "--cluster", address) == 0
    assert killed.is_set()
    rows = read(out / "results.jsonl")
    assert len(rows) == len({row["run"] for row in rows}) == 4 * 2 * 3
    assert all(row["error"] is None for row in rows)


def test_a_cluster_finds_what_one_machine_finds(bench, scheduler, small_results, tmp_path):
    address, worker = scheduler
    worker()
    assert bench(*SMALL, "--cluster", address) == 0
    assert untimed(rows_of(tmp_path / "out")) == untimed(rows_of(small_results))


def test_a_scheduler_without_workers_is_told(bench, scheduler, monkeypatch, capsys):
    monkeypatch.setattr(pool, "WORKER_TIMEOUT", 1.0)
    assert bench(*SMALL, "--cluster", scheduler[0]) == 2
    assert "has no workers" in capsys.readouterr().err


def test_a_worker_with_other_code_is_refused(bench, scheduler, monkeypatch, capsys):
    address, worker = scheduler
    worker()
    monkeypatch.setattr(pool, "own_code", lambda: "of tomorrow")
    assert bench(*SMALL, "--cluster", address) == 2
    assert "has another version of dynslam" in capsys.readouterr().err


def test_a_worker_that_joins_late_has_its_code_checked(bench, scheduler, monkeypatch, capsys):
    """It was checked at the start alone: runs of two versions stood side by side."""
    address, worker = scheduler
    worker()
    monkeypatch.setattr(pool, "_check_workers", lambda client, address: None)
    monkeypatch.setattr(pool, "own_code", lambda: "of tomorrow")
    assert bench(*SMALL, "--cluster", address) == 2
    assert "a worker that joined has another version" in capsys.readouterr().err


def test_a_scheduler_that_dies_is_told_in_one_line(scheduler, tmp_path):
    """asyncio and tornado told of it in fifty lines before."""
    address, worker = scheduler
    worker()
    command = [sys.executable, "-m", "dynslam_cli.main", "bench", "paper", "--seeds", "20",
               "--variants", "odometry", "--cluster", address, "--out", "out"]  # fmt: skip
    env = os.environ | {"DYNSLAM_CACHE": str(tmp_path / "cache")}
    bench = subprocess.Popen(
        command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=env
    )
    path = tmp_path / "out" / "results.jsonl"
    while not path.exists() and bench.poll() is None:
        time.sleep(0.05)
    kill(worker.scheduler)
    _, told = bench.communicate(timeout=120)
    assert bench.returncode == 2, told
    lines = told.splitlines(keepends=True)
    assert [one for one in lines if " runs: " not in one] == [  # but for lines of the progress
        f"dynslam: the scheduler at {address} is gone; --resume goes on\n"
    ]
