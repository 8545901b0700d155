"""Child process that does jobs, one after the other: `python -m dynslam_cli.trials.child`.

It may crash or hang without harm to the parent. Pickled jobs come on standard input, pickled
results go back on standard output.
"""

from __future__ import annotations

import faulthandler
import os
import pickle
import signal
import sys
import threading
import time
from typing import BinaryIO

PARENT_CHECK = 1.0  # s between looks whether the parent lives


def serve(jobs: BinaryIO, results: BinaryIO) -> None:
    """Do jobs until standard input ends. A job that exceeds its limit ends the process."""
    while True:
        try:
            job = pickle.load(jobs)
        except EOFError:
            return
        faulthandler.dump_traceback_later(job.limit, exit=True)
        done = job()
        faulthandler.cancel_dump_traceback_later()
        pickle.dump(done, results)
        results.flush()


def end_with_parent() -> None:
    """End this process, and those that it starts, when the parent has ended without a word, as by
    SIGTERM or SIGKILL: else it would do its job to the end."""
    if sys.platform != "win32":
        threading.Thread(target=_watch, args=(os.getppid(),), daemon=True).start()


def _watch(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(PARENT_CHECK)
    os.killpg(os.getpid(), signal.SIGKILL)  # the parent has made it the leader of a group


def main() -> None:
    """Serve jobs; prints of a variant go to standard error, standard output is for results."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is handled by the parent
    end_with_parent()
    results = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    serve(sys.stdin.buffer, results)


if __name__ == "__main__":
    main()
