"""A process that does jobs, one after the other: `python -m dynslam_cli.trials.child`.

It may crash or hang without harm to whoever gave the job. Jobs come pickled on standard input from
the process that started it, results go back on what was standard output.
"""

from __future__ import annotations

import faulthandler
import os
import pickle
import signal
import sys
from typing import BinaryIO


def serve(jobs: BinaryIO, results: BinaryIO) -> None:
    """Do jobs until no more come. One that takes longer than its limit ends the process."""
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


def main() -> None:
    """Keep standard output for results alone: what a variant prints goes to standard error."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for who gives the jobs
    results = os.fdopen(os.dup(sys.stdout.fileno()), "wb")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    serve(sys.stdin.buffer, results)


if __name__ == "__main__":
    main()
