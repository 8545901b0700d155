"""Running a program with limits of time and memory, and measuring what it takes (Linux)."""

from __future__ import annotations

import ctypes
import os
import signal
import subprocess
import sys
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from slam.errors import InputError

LOOK_EVERY = 0.01  # s between looks at a running program
MAX_LAST_OUTPUT = 1000  # characters of a failed program's output
PR_SET_PDEATHSIG = 1  # prctl: the signal that a process gets when its parent dies


class ProgramError(RuntimeError):
    """A program failed, took too long or too much memory."""


class Spent(NamedTuple):
    """What programs took, with those that they started.

    wall    s
    cpu     s, of all processors
    memory  MB, largest sum of the peaks of resident memory of processes that ran together
    """

    wall: float = 0.0
    cpu: float = 0.0
    memory: float = 0.0

    def then(self, other: Spent) -> Spent:
        """Both, one after the other."""
        memory = max(self.memory, other.memory)
        return Spent(self.wall + other.wall, self.cpu + other.cpu, memory)


def run_programs(
    commands: Sequence[Sequence[str]], folder: Path, limit: float, memory_mb: float
) -> Spent:
    """Run commands one after the other in `folder`; what they print goes to output.txt there.

    limit      s, of all of them
    memory_mb  of each with those that it starts

    Raises ProgramError at the first that fails, and InputError for one that cannot be started.
    """
    spent = Spent()
    for words in commands:
        spent = spent.then(_run(words, folder, limit - spent.wall, memory_mb, limit))
    return spent


def _run(words: Sequence[str], folder: Path, left: float, memory_mb: float, limit: float) -> Spent:
    child = _started(words, folder)
    begun, peak = time.monotonic(), 0.0
    try:
        while True:
            resident, high = _memory(child.pid)
            peak = max(peak, high)
            ended, status, usage = os.wait4(child.pid, os.WNOHANG)
            wall = time.monotonic() - begun
            if ended:
                break
            if wall > left:
                raise ProgramError(f"{words[0]}: more than the time limit of {limit:g} s")
            if resident > memory_mb:
                raise ProgramError(f"{words[0]}: more than the memory limit of {memory_mb:g} MB")
            time.sleep(LOOK_EVERY)
    except BaseException:
        _kill(child.pid)
        with suppress(ChildProcessError):
            os.waitpid(child.pid, 0)
        raise
    finally:
        child.returncode = 0  # it was waited for here
    _kill(child.pid)  # what it has left running
    code = os.waitstatus_to_exitcode(status)
    if code:
        raise ProgramError(f"{words[0]}: {_reason(code)}; {_last_output(folder)}".rstrip("; "))
    return Spent(wall, usage.ru_utime + usage.ru_stime, peak)


def _started(words: Sequence[str], folder: Path) -> subprocess.Popen[bytes]:
    if sys.platform != "linux":
        raise InputError("outside systems run on Linux only: memory is read from /proc")
    libc = ctypes.CDLL(None)

    def die_with_parent() -> None:
        libc.prctl(PR_SET_PDEATHSIG, signal.SIGKILL)

    try:
        with (folder / "output.txt").open("ab") as output:
            return subprocess.Popen(
                list(words), cwd=folder, stdin=subprocess.DEVNULL, stdout=output,
                stderr=subprocess.STDOUT, process_group=0, preexec_fn=die_with_parent,
            )  # fmt: skip
    except OSError as error:
        raise InputError(f"{words[0]}: cannot be started ({error.strerror or error})") from None


def _kill(group: int) -> None:
    with suppress(ProcessLookupError):
        os.killpg(group, signal.SIGKILL)


def _memory(pid: int) -> tuple[float, float]:
    """MB of resident memory now, and peak, of a process and those that it started."""
    resident = high = 0.0
    for one in _tree(pid):
        with suppress(OSError):
            for line in Path(f"/proc/{one}/status").read_text(errors="replace").splitlines():
                if line.startswith("VmRSS:"):
                    resident += int(line.split()[1]) * 1024 / 1e6
                elif line.startswith("VmHWM:"):
                    high += int(line.split()[1]) * 1024 / 1e6
    return resident, high


def _tree(pid: int) -> list[int]:
    found = [pid]
    for one in found:  # grows while it is gone through
        for children in Path(f"/proc/{one}/task").glob("*/children"):
            with suppress(OSError):
                found += map(int, children.read_text().split())
    return found


def _reason(code: int) -> str:
    return f"was ended by signal {-code}" if code < 0 else f"ended with status {code}"


def _last_output(folder: Path) -> str:
    text = (folder / "output.txt").read_text(errors="replace").strip()
    return text[-MAX_LAST_OUTPUT:]
