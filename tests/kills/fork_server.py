"""Starts `dynslam` commands by fork, with imports done and kernels loaded: in milliseconds.

    python -m tests.kills.fork_server FOLDER WORD...

runs the command of these words once in FOLDER, and then starts the commands that come as lines of
JSON on standard input, {"arguments": [WORD, ...], "log": PATH}; it answers by process ids, and to
{"wait": PID} by a status. Processes of jobs, which a command starts, are forked as well.
"""

# pyright: reportMissingImports=false
from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from types import SimpleNamespace
from typing import IO, Any, BinaryIO, NoReturn

import numpy as np
from dynslam_cli.main import status
from dynslam_cli.trials import child, worker_process

MAX_HANDLE = 4096  # of a file that is open


class ForkedChild:
    """As `subprocess.Popen` of `dynslam_cli.trials.child`, but forked."""

    def __init__(self, words: list[str], stderr: IO[bytes], **others: Any) -> None:
        (jobs, our_jobs), (our_results, results) = os.pipe(), os.pipe()
        self.pid = os.fork()
        if self.pid == 0:
            os.setsid()
            os.dup2(stderr.fileno(), 1)
            os.dup2(stderr.fileno(), 2)
            _close_all_but(jobs, results)  # pipes of others, and the lock of the folder
            signal.signal(signal.SIGINT, signal.SIG_IGN)
            _end_with(lambda: _serve(os.fdopen(jobs, "rb"), os.fdopen(results, "wb")))
        os.close(jobs)
        os.close(results)
        self.stdin, self.stdout = os.fdopen(our_jobs, "wb"), os.fdopen(our_results, "rb")
        self._status: int | None = None
        self._waiting = threading.Lock()

    def wait(self) -> int:
        """Its status, when it has ended."""
        with self._waiting:
            if self._status is None:
                self._status = os.waitstatus_to_exitcode(os.waitpid(self.pid, 0)[1])
            return self._status

    def poll(self) -> int | None:
        """Its status, if it has ended and that was noticed."""
        return self._status

    def kill(self) -> None:
        """End it."""
        if self._status is None:
            os.kill(self.pid, signal.SIGKILL)


def _close_all_but(*kept: int) -> None:
    low = 3
    for one in (*sorted(kept), MAX_HANDLE):
        os.closerange(low, one)
        low = one + 1


def _serve(jobs: BinaryIO, results: BinaryIO) -> int:
    child.serve(jobs, results)
    return 0


def _end_with(work: Callable[[], int]) -> NoReturn:
    """End this process with the status of `work`."""
    code = 70
    try:
        code = work()
    except SystemExit as error:
        code = error.code if isinstance(error.code, int) else 1
    except BaseException as error:
        print(repr(error), file=sys.stderr)
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


def start(arguments: list[str], log: str) -> int:
    """The process id of the command, forked."""
    pid = os.fork()
    if pid == 0:
        handle = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_APPEND)
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        os.dup2(handle, 1)
        os.dup2(handle, 2)
        _end_with(lambda: status(arguments))
    return pid


def warm_up(arguments: list[str]) -> None:
    """Run the command here, and its jobs too: all is imported and compiled.

    Of a training, all but the learning: threads of torch do not come along with a fork, and the
    first step of learning would wait for them forever.
    """
    if arguments[0] == "train":
        return _load_training()
    done = worker_process.WorkerProcess.do
    worker_process.WorkerProcess.do = lambda self, job: job()
    try:
        code = status(arguments)
    finally:
        worker_process.WorkerProcess.do = done
    if code not in (0, 3):
        raise SystemExit(f"{arguments}: status {code}")
    forking = SimpleNamespace(Popen=ForkedChild, PIPE=subprocess.PIPE)
    worker_process.subprocess = forking  # type: ignore[assignment]
    _tell_threads()


def _load_training() -> None:
    from agents.training.train import NativeVecEnv

    worlds = NativeVecEnv.make("DoorPatrol-v0", 2, slam="odometry")
    worlds.reset()
    for _ in range(40):
        worlds.step(np.zeros((2, 2), np.float32))
    _tell_threads()


def _tell_threads() -> None:
    left = [one.name for one in threading.enumerate() if one is not threading.main_thread()]
    print(f"threads left: {left}", file=sys.stderr)


def main() -> None:
    """Serve until standard input ends."""
    answers = os.fdopen(os.dup(1), "w")
    os.dup2(2, 1)
    os.chdir(sys.argv[1])
    warm_up(sys.argv[2:])
    print("ready", file=answers, flush=True)
    for line in sys.stdin:
        asked = json.loads(line)
        if "wait" in asked:
            answer = os.waitstatus_to_exitcode(os.waitpid(asked["wait"], 0)[1])
        else:
            answer = start(asked["arguments"], asked["log"])
        print(answer, file=answers, flush=True)


if __name__ == "__main__":
    main()
