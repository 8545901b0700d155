"""Files that nobody would write, for as long as you like: every reader, and what uses its result.

    python -m tests.fuzz.fuzz --seconds 60
    python -m tests.fuzz.fuzz --seconds 600 --only ros1.bag --seed 3

A finding is whatever is neither a result nor one line of InputError that names the file: another
exception, a crash of the process, more than LIMIT_S of processor time, or more memory than the
bound of `slam.io.guard`. It is written to tests/fuzz/findings/NUMBER-NAME, where pytest reads it
from then on. The same seed gives the same files.
"""

from __future__ import annotations

import argparse
import contextlib
import faulthandler
import gc
import hashlib
import io
import os
import random
import resource
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Iterator
from pathlib import Path

from slam.errors import InputError
from slam.io.guard import FLOOR, PER_BYTE
from tests.fuzz.mutate import mutated
from tests.fuzz.targets import Target, targets

FINDINGS = Path(__file__).parent / "findings"
LIMIT_S = 2.0  # of processor time for a file
STUCK_S = 60  # wall time after which a process that does not answer is ended
BATCH = 500  # files for a process; its memory is measured
OWN_MB = 60  # that the fuzzer's process itself may take beside
RUN_PAST = 10  # findings after which it stops


class TooSlowError(Exception):
    """A file took more processor time than LIMIT_S."""


def check(target: Target, data: bytes, folder: Path) -> str:
    """Read `data` as the target's file in `folder`; empty, or what was wrong."""
    path = folder / target.name
    path.write_bytes(data)
    try:
        with _limited(), contextlib.redirect_stderr(io.StringIO()):
            target.read(path)
    except InputError as error:
        return _wrong_message(str(error), folder)
    except BaseException:
        return traceback.format_exc()
    return ""


def _wrong_message(text: str, folder: Path) -> str:
    named = str(folder) in text
    short = len(text.replace(str(folder), "")) < 500
    return "" if named and short and "\n" not in text else f"the message is {text!r}"


@contextlib.contextmanager
def _limited() -> Iterator[None]:
    def stop(number: int, frame: object) -> None:
        raise TooSlowError(f"more than {LIMIT_S} s of processor time")

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, LIMIT_S)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)


def peak_mb() -> float:
    """Peak of the memory of this process, MB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def batch(target: Target, seed: int, folder: Path, count: int = BATCH) -> tuple[int, str]:
    """Check `count` mutations in a process of its own; how many were done, and what was wrong."""
    gc.collect()
    read_end, write_end = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(read_end)
        _serve(target, seed, folder, count, write_end)
    os.close(write_end)
    with os.fdopen(read_end, "rb") as pipe:
        told = pipe.read().decode(errors="replace")
    status = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    done, _, wrong = told.partition("\n")
    if status and not wrong:
        wrong = f"the process ended with status {status}"
    return int(done or count), wrong


def _serve(target: Target, seed: int, folder: Path, count: int, pipe: int) -> None:
    faulthandler.dump_traceback_later(STUCK_S + count, exit=True)
    own = peak_mb()
    for number in range(count):
        data = mutated(target.data, random.Random(f"{seed} {target.name} {number}"))
        wrong = check(target, data, folder)
        taken = peak_mb() - own
        if not wrong and taken > FLOOR + OWN_MB + PER_BYTE * len(data) / 1e6:
            wrong = f"it took {taken:.0f} MB for {len(data)} bytes"
        if wrong:
            os.write(pipe, f"{number + 1}\n{wrong[-3000:]}".encode())
            os._exit(0)
    os.write(pipe, f"{count}\n".encode())
    os._exit(0)


def keep(target: Target, folder: Path) -> Path:
    """The file that was read last, as a finding."""
    data = (folder / target.name).read_bytes()
    FINDINGS.mkdir(exist_ok=True)
    path = FINDINGS / f"{hashlib.sha256(data).hexdigest()[:8]}-{target.name}"
    path.write_bytes(data)
    return path


@contextlib.contextmanager
def place() -> Iterator[Path]:
    """A folder in memory with all the samples in it: some files name others."""
    memory = Path("/dev/shm")
    with tempfile.TemporaryDirectory(dir=memory if memory.is_dir() else None) as name:
        for target in targets().values():
            (Path(name) / target.name).write_bytes(target.data)
        yield Path(name)


def run(seconds: float, only: str | None, seed: int) -> int:
    """Fuzz for some seconds; prints the executions of each file, and the findings. Their number."""
    warnings.simplefilter("error", RuntimeWarning)
    warnings.filterwarnings("ignore", "Duplicate name", UserWarning)  # the mutator's archives
    chosen = [one for one in targets().values() if only in (None, one.name)]
    done, found = dict.fromkeys((one.name for one in chosen), 0), 0
    end = time.monotonic() + seconds
    with place() as folder:
        for target in chosen:  # kernels compile, and modules are loaded, before memory is measured
            wrong = check(target, target.data, folder)
            assert not wrong, f"the sample {target.name}: {wrong}"
        while time.monotonic() < end and found < RUN_PAST:
            for target in chosen:
                seed += 1
                count, wrong = batch(target, seed, folder)
                done[target.name] += count
                if wrong:
                    found += 1
                    print(f"{keep(target, folder)}:\n{wrong}", flush=True)
                (folder / target.name).write_bytes(target.data)
                if time.monotonic() > end:
                    break
    for name, count in done.items():
        print(f"{count:>9}  {name}")
    print(f"{sum(done.values()):>9}  files read, {found} findings")
    return found


def main() -> None:
    """The command line."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    options.add_argument("--seconds", type=float, default=60.0)
    options.add_argument("--only", choices=list(targets()))
    options.add_argument("--seed", type=int, default=0)
    given = options.parse_args()
    sys.exit(min(run(given.seconds, given.only, given.seed), 1))


if __name__ == "__main__":
    main()
