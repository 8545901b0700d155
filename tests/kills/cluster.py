"""Many tiny runs on a Dask cluster on loopback, whose workers are killed and join at random.

    python -m tests.kills.cluster --runs 10000 --workers 8 --kill-every 5

At the end every run must be there once, without an error. Prints what happened.
"""

from __future__ import annotations

import argparse
import os
import random
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from slam.benchmark.results import read

CASES = 20  # of each seed: they share its drive, which takes longer to record than to run
SUITE = 'variants = ["odometry"]\n' + "".join(
    f"""
[[case]]
name = "{case}"
env = "DoorCorridor-v0"
max_episode_steps = 5
every = 5
"""
    for case in range(CASES)
)
LISTENS_WITHIN = 120.0  # s, the scheduler
JOIN_AFTER = 2.0  # s at most, from a worker's death to the next one's start


def started(folder: Path, *words: str) -> subprocess.Popen[bytes]:
    """A command of this Python in a group of its own, its output kept in `folder`."""
    with (folder / f"{words[1]}.txt").open("ab") as log:
        command = [sys.executable, "-m", *words]
        return subprocess.Popen(command, stdout=log, stderr=log, start_new_session=True)


def end(process: subprocess.Popen[bytes]) -> None:
    """Kill a process and all that it started."""
    if process.poll() is None:
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()


def await_scheduler(address: str) -> None:
    """Until it listens."""
    host, port = address.removeprefix("tcp://").split(":")
    until = time.monotonic() + LISTENS_WITHIN
    while time.monotonic() < until:
        try:
            return socket.create_connection((host, int(port)), timeout=1).close()
        except OSError:
            time.sleep(0.1)


def tried(runs: int, workers: int, kill_every: float, seed: int, folder: Path) -> int:
    """Run it; the number of workers that were killed."""
    rng = random.Random(seed)
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        address = f"tcp://127.0.0.1:{free.getsockname()[1]}"
    suite = folder / "tiny.toml"
    suite.write_text(SUITE)
    scheduler = started(folder, "dask", "scheduler", "--host", "127.0.0.1", "--port",
                        address.rsplit(":", 1)[1], "--no-dashboard")  # fmt: skip
    await_scheduler(address)
    worker = ("dask", "worker", address, "--nthreads", "1", "--no-dashboard")
    pool = [started(folder, *worker) for _ in range(workers)]
    bench = started(folder, "dynslam_cli.main", "bench", str(suite), "--seeds", str(runs // CASES),
                    "--cluster", address, "--out", str(folder / "out"))  # fmt: skip
    killed = 0
    try:
        while bench.poll() is None:
            time.sleep(rng.expovariate(1 / kill_every))
            one = rng.randrange(len(pool))
            end(pool[one])
            killed += 1
            time.sleep(rng.uniform(0, JOIN_AFTER))
            pool[one] = started(folder, *worker)
    finally:
        for process in (bench, *pool, scheduler):
            end(process)
    return killed


def main(arguments: Sequence[str] | None = None) -> int:
    """0 if nothing was lost and nothing is there twice."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=10_000)
    parser.add_argument("--workers", type=int, default=8)
    parser.add_argument("--kill-every", type=float, default=5.0, help="s, mean")
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args(arguments)
    if given.runs % CASES:
        parser.error(f"--runs must be a multiple of {CASES}")
    with tempfile.TemporaryDirectory() as name:
        folder, begun = Path(name), time.monotonic()
        os.environ["DYNSLAM_CACHE"] = str(folder / "cache")
        killed = tried(given.runs, given.workers, given.kill_every, given.seed, folder)
        path = folder / "out" / "results.jsonl"
        rows = read(path) if path.exists() else []
        told = (folder / "bench.txt").read_text()
        took = time.monotonic() - begun
    once, failed = {row["run"] for row in rows}, [row for row in rows if row["error"]]
    print(
        f"{given.runs} runs, {len(once)} there, {len(rows) - len(once)} twice, {len(failed)} "
        f"failed; {killed} workers killed, {took:.0f} s"
    )
    if not rows:
        print(told)
    for row in failed[:5]:
        print(row["error"])
    return int(len(once) < given.runs or len(rows) > len(once) or bool(failed))


if __name__ == "__main__":
    sys.exit(main())
