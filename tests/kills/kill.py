"""Kill commands at random moments, a second process on the same folder; then finish the work.

    python -m tests.kills.kill --kills 20
    python -m tests.kills.kill --kills 200 --only bench --seed 3

A round starts a command again and again in one folder, with --resume where it has that, beside a
second process of the same command, and ends both by SIGKILL. After KILLS_A_ROUND kills the command
is run to its end: every file must then have the bytes of an undisturbed run, times aside, and no
temporary file may be left.

Most of the time of a small command is Python's imports and the loading of kernels, which write
nothing. Processes are therefore forked from one that has done both (`fork_server`), and killed at
any moment of the work; in one round of NEW_EACH they are new processes, killed at any moment. The
undisturbed run is a new process.
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
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from scripts.trials.worker_process import ONE_THREAD
from tests.slam.io.samples import small_drive

KILLS_A_ROUND = 5
NEW_EACH = 10  # rounds, of which the last is one of new processes
ROOT = Path(__file__).parents[2]
TIMED = (
    "finished", "seconds", "seconds_in_all", "seconds_compiling", "cpu_seconds", "ms_per_step",
    "ms_per_matched_scan", "peak_memory_mb", "memory_mb", "commit",
)  # fmt: skip
"""What differs from run to run in rows and summaries; the commit, if the checkout is edited."""
OF_TIMES = (".html", ".csv", ".png", ".svg", ".md", ".tex")  # pages that show times: names alone
FOLDERS_OF_TIMES = ("tensorboard",)
SUITE = """
variants = ["odometry", "static-ml"]
seeds = 2
[[case]]
env = "DoorCorridor-v0"
max_episode_steps = 20
"""
SHORT_PATROL = """
import gymnasium
from dynslam_env import Corridor

gymnasium.register(
    "ShortPatrol-v0",
    vector_entry_point="dynslam_env.patrol.vector:DoorPatrolVectorEnv",
    max_episode_steps=20,  # DoorPatrol-v0 has 250, which an evaluation drives
)
"""
SETTINGS = """
ShortPatrol-v0:
  policy: MultiInputPolicy
  n_envs: 2
  n_steps: 2
  n_timesteps: 320
  batch_size: 4
  n_epochs: 1
  policy_kwargs: "dict(net_arch=[8])"
"""


class Command(NamedTuple):
    """Arguments of a `dynslam` command that writes to --out, and whether it can go on."""

    arguments: str
    resumes: bool = False


COMMANDS = {
    "bench": Command("bench suite.toml --jobs 2", resumes=True),
    "map": Command("map drive.csv --slam static-ml --skip all"),
    "run": Command("run drive.csv --slam static-ml"),
    "record": Command("record DoorCorridor-v0 --seeds 5000-5001"),
    "train": Command(
        "train --env ShortPatrol-v0 --world short.py:Corridor --slam odometry "
        "--hyperparameters settings.yml --workers 1",
        resumes=True,
    ),
    "evaluate": Command(
        "evaluate random wall-follower --worlds corridor --slam odometry --episodes 2 --steps 8 "
        "--no-films --jobs 2",
        resumes=True,
    ),
}


class NewProcess:
    """A command, started as a user does."""

    def __init__(self, arguments: list[str], work: Path) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-m", "dynslam_cli.main", *arguments],
            cwd=work, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, env=environment(work),
        )  # fmt: skip

    def kill(self) -> None:
        """End it by SIGKILL."""
        self._process.kill()
        self._process.communicate()

    def wait(self) -> tuple[int, str]:
        """Its status, and what it told."""
        _, told = self._process.communicate(timeout=1200)
        return self._process.returncode, told.decode()


class Forks:
    """Commands, forked from a process that has run one before."""

    def __init__(self, arguments: list[str], work: Path) -> None:
        self._work = work
        self._server = subprocess.Popen(
            [sys.executable, "-m", "tests.kills.fork_server", str(work), *arguments], cwd=ROOT,
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=(work / "server.txt").open("wb"),
            env=environment(work), text=True,
        )  # fmt: skip
        if self._answer() != "ready":
            raise SystemExit((work / "server.txt").read_text())

    def start(self, arguments: list[str], work: Path) -> Fork:
        """See `NewProcess`."""
        log = self._work / "fork.txt"
        log.unlink(missing_ok=True)
        return Fork(int(self.ask({"arguments": arguments, "log": str(log)})), log, self)

    def ask(self, what: dict[str, Any]) -> str:
        """The server's answer."""
        assert self._server.stdin is not None
        print(json.dumps(what), file=self._server.stdin, flush=True)
        return self._answer()

    def stop(self) -> None:
        """End the server."""
        self._server.communicate()

    def _answer(self) -> str:
        assert self._server.stdout is not None
        return self._server.stdout.readline().strip()


class Fork(NamedTuple):
    """As `NewProcess`."""

    pid: int
    log: Path
    server: Forks

    def kill(self) -> None:
        """End it by SIGKILL."""
        os.kill(self.pid, signal.SIGKILL)
        self.wait()

    def wait(self) -> tuple[int, str]:
        """Its status, and what it told."""
        status = int(self.server.ask({"wait": self.pid}))
        return status, self.log.read_text(errors="replace")


Start = Callable[[list[str], Path], NewProcess | Fork]


def environment(work: Path) -> dict[str, str]:
    """With a cache of drives of our own, and one thread a process: threads do not fork."""
    own = {"DYNSLAM_CACHE": str(work / "cache"), "PYTHONPATH": str(ROOT)}
    return os.environ | ONE_THREAD | own


def words(command: Command, work: Path, out: str) -> list[str]:
    """Of the command line, in the folder `work`."""
    resume = ["--resume"] if command.resumes and (work / out).exists() else []
    return [*command.arguments.split(), "--out", out, *resume]


def finish(command: Command, work: Path, out: str, start: Start) -> float:
    """Run to the end; the time it took, s."""
    begun = time.monotonic()
    status, told = start(words(command, work, out), work).wait()
    if status not in (0, 3):
        raise SystemExit(f"{command.arguments}: status {status}: {told}")
    return time.monotonic() - begun


def disturb(
    command: Command, work: Path, out: str, start: Start, longest: float, chance: random.Random
) -> None:
    """Two processes in one folder, both killed at a random moment."""
    pair = [start(words(command, work, out), work) for _ in range(2)]
    try:
        time.sleep(chance.uniform(0, longest))
    finally:
        for process in pair:
            process.kill()


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
    (work / "short.py").write_text(SHORT_PATROL)
    write_log(small_drive(scans=400, beams=40), work / "drive.csv")


def trial(name: str, kills: int, work: Path, chance: random.Random) -> list[str]:
    """`kills` kills of one command; what went wrong."""
    command, wrong = COMMANDS[name], []
    forks = Forks(words(command, work, f"{name}-warm"), work)  # kernels compile
    longest_new = 1.1 * finish(command, work, f"{name}-whole", NewProcess)
    expected = contents(work / f"{name}-whole")
    took = []
    for number in range(3):  # the fastest: the machine may be busy with other work
        took.append(finish(command, work, f"{name}-forked-{number}", forks.start))
        wrong += _compared(expected, work, f"{name}-forked-{number}")
    longest = 1.1 * min(took)
    print(f"{name}: {longest_new:.1f} s, forked {longest:.1f} s", flush=True)
    for number in range(-(-kills // KILLS_A_ROUND)):
        out, new = f"{name}-{number}", number % NEW_EACH == NEW_EACH - 1
        for _ in range(KILLS_A_ROUND):
            start, most = (NewProcess, longest_new) if new else (forks.start, longest)
            disturb(command, work, out, start, most, chance)
        finish(command, work, out, NewProcess if new else forks.start)
        other = _compared(expected, work, out)
        wrong += other
        told = f", wrong: {', '.join(other)}" if other else ""
        how = "new processes" if new else "forked"
        print(f"{name}: {KILLS_A_ROUND * (number + 1)} kills, {how}{told}", flush=True)
    forks.stop()
    return wrong


def _compared(expected: dict[str, Any], work: Path, out: str) -> list[str]:
    other = differences(expected, contents(work / out))
    return [f"{out}: {', '.join(other)}"] if other else []


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
