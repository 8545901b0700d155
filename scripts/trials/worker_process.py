"""The parent's side of `child`: processes that do jobs, and are replaced when a job kills them."""

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

import cloudpickle

from .jobs import Done, Job, failure

ONE_THREAD = {f"{name}_NUM_THREADS": "1" for name in ("OMP", "OPENBLAS", "MKL", "NUMBA", "NUMEXPR")}
MAX_LAST_OUTPUT = 2000  # characters of the standard error of a dead process


class WorkerProcess:
    """A child process, started when it is needed."""

    def __init__(self) -> None:
        self._child: subprocess.Popen[bytes] | None = None
        self._stderr: IO[bytes] = io.BytesIO()

    def do(self, job: Job) -> Done:
        """Do a job; one that kills its process or exceeds its limit counts as failed."""
        child = self._ready()
        assert child.stdin is not None
        assert child.stdout is not None
        begun = time.monotonic()
        try:
            cloudpickle.dump(job, child.stdin)  # with parts that the user defined in __main__
            child.stdin.flush()
            return pickle.load(child.stdout)
        except (EOFError, OSError, pickle.UnpicklingError):  # OSError: broken pipe
            status, took = child.wait(), time.monotonic() - begun
            self._child = None
            output = self._last_output()
        return Done(job.row() | failure(_death(status, took, job.limit, output)))

    def stop(self) -> None:
        """Kill the process."""
        child, self._child = self._child, None
        if child is not None:
            child.kill()
            child.wait()
            for pipe in (child.stdin, child.stdout):
                with suppress(OSError):
                    pipe.close()  # pyright: ignore[reportOptionalMemberAccess]
        self._stderr.close()

    def _ready(self) -> subprocess.Popen[bytes]:
        """The process, its old output dropped; a new one if it ended while idle."""
        if self._child is None or self._child.poll() is not None:
            return self._start()
        self._stderr.seek(0)  # the child continues to write at this position
        self._stderr.truncate()
        return self._child

    def _start(self) -> subprocess.Popen[bytes]:
        self._stderr.close()
        self._stderr = tempfile.TemporaryFile(buffering=0)  # noqa: SIM115  (closed with the child)
        self._child = subprocess.Popen(
            [sys.executable, "-P", "-m", "dynslam_cli.trials.child"],  # -P: not of this folder
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._stderr,
            env=os.environ | ONE_THREAD | {"PYTHONPATH": os.pathsep.join(sys.path)},
            start_new_session=True,
        )
        threading.Thread(target=_kill_group_at_end, args=(self._child,), daemon=True).start()
        return self._child

    def _last_output(self) -> str:
        end = self._stderr.seek(0, os.SEEK_END)
        self._stderr.seek(max(end - 4 * MAX_LAST_OUTPUT, 0))
        return self._stderr.read().decode(errors="replace").strip()


class WorkerProcesses:
    """As many processes as the threads that share this object need; all end with it."""

    def __init__(self) -> None:
        self._idle: list[WorkerProcess] = []
        self._all: list[WorkerProcess] = []
        self._lock = threading.Lock()

    def do(self, job: Job) -> Done:
        """Do a job in an idle process, or in a new one."""
        with self._lock:
            if self._idle:
                process = self._idle.pop()
            else:
                process = WorkerProcess()
                self._all.append(process)
        done = process.do(job)
        with self._lock:
            self._idle.append(process)
        return done

    def __enter__(self) -> WorkerProcesses:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        at: TracebackType | None,
    ) -> None:
        for process in self._all:
            process.stop()


def _kill_group_at_end(child: subprocess.Popen[bytes]) -> None:
    """When the child ends, kill the processes it started: they may hold its pipes open."""
    child.wait()
    if sys.platform != "win32":
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(child.pid, signal.SIGKILL)


def _death(status: int, took: float, limit: float, output: str) -> str:
    """Why a process ended during a job."""
    if took >= limit:
        why = f"hung: more than the time limit of {limit:g} s"
    elif status < 0:
        why = f"the process was ended by signal {-status}"
    else:
        why = f"the process ended with status {status}"
    return f"{why}; {output[-MAX_LAST_OUTPUT:]}" if output else why
