"""The other side of `child`: processes that are given jobs, and replaced where one kills them."""

from __future__ import annotations

import io
import os
import pickle
import signal
import subprocess
import sys
import tempfile
import threading
import time
from contextlib import suppress
from types import TracebackType
from typing import IO

from .jobs import Done, Job, failure

ONE_THREAD = {f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL", "NUMBA", "NUMEXPR")}
TOLD = 2000  # characters of a dead process's last words


class WorkerProcess:
    """One child process, which is there when it is needed."""

    def __init__(self) -> None:
        self._child: subprocess.Popen[bytes] | None = None
        self._words: IO[bytes] = io.BytesIO()  # what it says on standard error

    def do(self, job: Job) -> Done:
        """Have it done; a job that ends or outlasts its process is told as failed."""
        child = self._ready()
        assert child.stdin is not None
        assert child.stdout is not None
        begun = time.monotonic()
        try:
            pickle.dump(job, child.stdin)
            child.stdin.flush()
            return pickle.load(child.stdout)
        except (EOFError, OSError, pickle.UnpicklingError):  # OSError: a pipe that is broken
            status, took = child.wait(), time.monotonic() - begun
            self._child = None
            words = self._last_words()
        return Done(job.row() | failure(_death(status, took, job.limit, words)))

    def stop(self) -> None:
        """End the process, whatever it does."""
        child, self._child = self._child, None
        if child is not None:
            child.kill()
            child.wait()
            for pipe in (child.stdin, child.stdout):
                with suppress(OSError):
                    pipe.close()  # pyright: ignore[reportOptionalMemberAccess]
        self._words.close()

    def _ready(self) -> subprocess.Popen[bytes]:
        """The process, what it said forgotten; another where it ended with nothing to do."""
        if self._child is None or self._child.poll() is not None:
            return self._start()
        self._words.seek(0)  # its standard error is written from here on, too
        self._words.truncate()
        return self._child

    def _start(self) -> subprocess.Popen[bytes]:
        self._words.close()
        self._words = tempfile.TemporaryFile(buffering=0)  # noqa: SIM115  (closed with the child)
        self._child = subprocess.Popen(
            [
                sys.executable,
                "-P",
                "-m",
                "dynslam_cli.trials.child",
            ],  # -P: not what lies about here
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._words,
            env=os.environ | ONE_THREAD | {"PYTHONPATH": os.pathsep.join(sys.path)},
            start_new_session=True,
        )
        threading.Thread(target=_bury, args=(self._child,), daemon=True).start()
        return self._child

    def _last_words(self) -> str:
        end = self._words.seek(0, os.SEEK_END)
        self._words.seek(max(end - 4 * TOLD, 0))
        return self._words.read().decode(errors="replace").strip()


class WorkerProcesses:
    """As many as are needed at once, by the threads that share this object; all end with it."""

    def __init__(self) -> None:
        self._idle: list[WorkerProcess] = []
        self._all: list[WorkerProcess] = []
        self._lock = threading.Lock()

    def do(self, job: Job) -> Done:
        """Have it done by one that has nothing to do, or by a new one."""
        with self._lock:
            if self._idle:
                keeper = self._idle.pop()
            else:
                keeper = WorkerProcess()
                self._all.append(keeper)
        done = keeper.do(job)
        with self._lock:
            self._idle.append(keeper)
        return done

    def __enter__(self) -> WorkerProcesses:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        at: TracebackType | None,
    ) -> None:
        for keeper in self._all:
            keeper.stop()


def _bury(child: subprocess.Popen[bytes]) -> None:
    """When it ends, end what it started: that may hold its pipes, and nobody would learn of it."""
    child.wait()
    if sys.platform != "win32":
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(child.pid, signal.SIGKILL)


def _death(status: int, took: float, limit: float, words: str) -> str:
    """What to say of a process that ended over its job."""
    if took >= limit:
        why = f"hung: more than the time limit of {limit:g} s"
    elif status < 0:
        why = f"the process was ended by signal {-status}"
    else:
        why = f"the process ended with status {status}"
    return f"{why}; {words[-TOLD:]}" if words else why
