"""Kill commands at random moments, a second process on the same folder; then finish the work.

    python -m tests.kills.kill --kills 20
    python -m tests.kills.kill --kills 200 --only bench --seed 3

A round starts a command again and again in one folder, with --resume where it has that, beside a
second process of the same command, and ends both by SIGKILL. After KILLS_A_ROUND kills the command
is run to its end: every file must then have the bytes of an undisturbed run, times aside, and no
temporary file may be left.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
import zipfile
from pathlib import Path
from typing import Any, NamedTuple

from tests.slam.io.samples import small_drive

KILLS_A_ROUND = 5
ROOT = Path(__file__).parents[2]
TIMED = (
    "finished", "seconds", "cpu_seconds", "ms_per_matched_scan", "ms_per_step", "peak_memory_mb",
    "memory_mb", "commit",
)  # fmt: skip
"""What differs from run to run in rows and summaries; the commit, if the checkout is edited."""
OF_TIMES = (".html", ".csv", ".png", ".svg", ".md", ".tex")  # pages that show times: names alone
FOLDERS_OF_TIMES = ("tensorboard",)
SUITE = """
variants = ["odometry", "static-ml"]
seeds = 2
[[case]]
env = "DoorCorridor-v0"
max_episode_steps = 60
"""
SETTINGS = """
DoorPatrol-v0:
  policy: MultiInputPolicy
  n_envs: 2
  n_steps: 16
  n_timesteps: 1600
  batch_size: 16
  n_epochs: 1
  policy_kwargs: "dict(net_arch=[8])"
"""


class Command(NamedTuple):
    """Arguments of a `dynslam` command that writes to --out, and whether it can go on."""

    arguments: tuple[str, ...]
    resumes: bool = False


COMMANDS = {
    "bench": Command(("bench", "suite.toml", "--jobs", "2"), resumes=True),
    "map": Command(("map", "drive.csv", "--slam", "static-ml", "--skip", "all")),
    "run": Command(("run", "drive.csv", "--slam", "static-ml")),
    "record": Command(("record", "DoorCorridor-v0", "--seeds", "5000-5001")),
    "train": Command(
        ("train", "--slam", "odometry", "--hyperparameters", "settings.yml", "--workers", "1"),
        resumes=True,
    ),
    "evaluate": Command(
        (
            "evaluate",
            "random",
            "wall-follower",
            "--worlds",
            "corridor",
            "--slam",
            "odometry",
            "--episodes",
            "2",
            "--steps",
            "20",
            "--no-films",
            "--jobs",
            "2",
        ),
        resumes=True,
    ),
}


def start(command: Command, work: Path, out: str, cache: str = "cache") -> subprocess.Popen[bytes]:
    """The command as a process, in the folder `work`."""
    resume = ("--resume",) if command.resumes and (work / out).exists() else ()
    return subprocess.Popen(
        [sys.executable, "-m", "dynslam_cli.main", *command.arguments, "--out", out, *resume],
        cwd=work, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
        env=os.environ | {"DYNSLAM_CACHE": str(work / cache), "PYTHONPATH": str(ROOT)},
    )  # fmt: skip


def finish(command: Command, work: Path, out: str) -> float:
    """Run to the end; the time it took, s."""
    begun = time.monotonic()
    process = start(command, work, out)
    _, told = process.communicate(timeout=1200)
    if process.returncode not in (0, 3):
        raise SystemExit(f"{command.arguments}: status {process.returncode}: {told.decode()}")
    return time.monotonic() - begun


def disturb(command: Command, work: Path, out: str, longest: float, chance: random.Random) -> None:
    """Two processes in one folder, both killed at a random moment."""
    pair = [start(command, work, out), start(command, work, out)]
    try:
        time.sleep(chance.uniform(0, longest))
    finally:
        for process in pair:
            process.send_signal(signal.SIGKILL)
            process.communicate()


def contents(folder: Path) -> dict[str, Any]:
    """Every file by its name, without times."""
    found: dict[str, Any] = {}
    for path in sorted(folder.rglob("*")):
        name = path.relative_to(folder).as_posix()
        if path.is_file() and not name.startswith(FOLDERS_OF_TIMES):
            found[name] = _content(path)
    return found


def _content(path: Path) -> Any:
    if path.suffix == ".jsonl":
        rows = [_untimed(json.loads(line)) for line in path.read_text().splitlines()]
        return sorted(json.dumps(row, sort_keys=True) for row in rows)
    if path.suffix == ".json":
        return _untimed(json.loads(path.read_text()))
    if path.suffix == ".zip":  # of stable-baselines3: beside the weights, when it was written
        with zipfile.ZipFile(path) as archive:
            return [archive.read(name) for name in ("policy.pth", "dynslam.json")]
    return None if path.suffix in OF_TIMES and path.name != "lost.csv" else path.read_bytes()


def _untimed(row: Any) -> Any:
    return {key: row[key] for key in row if key not in TIMED} if isinstance(row, dict) else row


def differences(expected: dict[str, Any], found: dict[str, Any]) -> list[str]:
    """Names of files that are missing, too many, or other."""
    names = sorted(expected.keys() | found.keys())
    return [name for name in names if expected.get(name, ...) != found.get(name, ...)]


def prepare(work: Path) -> None:
    """The files that the commands read."""
    from slam.io.formats import write_log

    (work / "suite.toml").write_text(SUITE)
    (work / "settings.yml").write_text(SETTINGS)
    write_log(small_drive(scans=400, beams=40), work / "drive.csv")


def trial(name: str, kills: int, work: Path, chance: random.Random) -> list[str]:
    """`kills` kills of one command; what went wrong."""
    command, wrong = COMMANDS[name], []
    finish(command, work, f"{name}-first")  # kernels compile
    longest = 1.1 * finish(command, work, f"{name}-whole")
    expected = contents(work / f"{name}-whole")
    for number in range(-(-kills // KILLS_A_ROUND)):
        out = f"{name}-{number}"
        for _ in range(KILLS_A_ROUND):
            disturb(command, work, out, longest, chance)
        finish(command, work, out)
        other = differences(expected, contents(work / out))
        wrong += [f"{name}, round {number}: {', '.join(other)}"] if other else []
        told = f", wrong: {', '.join(other)}" if other else ""
        print(f"{name}: {KILLS_A_ROUND * (number + 1)} kills{told}", flush=True)
    return wrong


def main() -> None:
    """The command line."""
    options = argparse.ArgumentParser(description="Kill commands at random moments.")
    options.add_argument("--kills", type=int, default=20)
    options.add_argument("--only", choices=list(COMMANDS))
    options.add_argument("--seed", type=int, default=0)
    given = options.parse_args()
    chance, wrong = random.Random(given.seed), []
    with tempfile.TemporaryDirectory() as folder:
        prepare(Path(folder))
        for name in COMMANDS if given.only is None else [given.only]:
            wrong += trial(name, given.kills, Path(folder), chance)
    print("\n".join(wrong) or "all files as of undisturbed runs")
    sys.exit(bool(wrong))


if __name__ == "__main__":
    main()
