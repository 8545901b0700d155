"""Files that nobody would write, for as long as you like: every reader, and what uses its result.

    python -m tests.fuzz.fuzz --seconds 60
    python -m tests.fuzz.fuzz --seconds 600 --only ros1.bag --seed 3
    python -m tests.fuzz.fuzz --seconds 7200 --executions 1000000

A finding is whatever is neither a result nor one line of InputError that names the file: another
exception, a crash of the process, more than LIMIT_S of processor time, more memory than the bound
of `slam.io.guard`, or a result that `tests.fuzz.oracles` finds wrong. The first of each kind is
written to tests/fuzz/findings/NUMBER-NAME, where pytest reads it from then on. The same seed gives
the same files.
"""

from __future__ import annotations

import argparse
import contextlib
import faulthandler
import gc
import hashlib
import io
import json
import math
import os
import random
import resource
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from slam.errors import InputError
from slam.io.guard import FLOOR, PER_BYTE
from tests.fuzz.mutate import mutated
from tests.fuzz.targets import Target, targets

FINDINGS = Path(__file__).parent / "findings"
LIMIT_S = 2.0  # of processor time for a file
STUCK_S = 60  # wall time after which a process that does not answer is ended
BATCH = 1000  # files for a process; its memory is measured
OWN_MB = 60  # that the fuzzer's process itself may take beside
MOST_KINDS = 20  # of findings, after which it stops
TOLD_EVERY = 60.0  # s, how far it is


class TooSlowError(Exception):
    """A file took more processor time than LIMIT_S."""


def check(target: Target, data: bytes, folder: Path) -> str | None:
    """Read `data` as the target's file in `folder`: empty if it was read, None if it was refused
    rightly, or what was wrong."""
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


def _wrong_message(text: str, folder: Path) -> str | None:
    named = str(folder) in text
    short = len(text.replace(str(folder), "")) < 500
    return None if named and short and "\n" not in text else f"the message is {text!r}"


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


class Batch(NamedTuple):
    """What became of some files: how many were read at all, how many of them accepted, and what was
    wrong with the last one; processor time of all, s."""

    done: int
    accepted: int
    wrong: str
    seconds: float = 0.0


def batch(target: Target, seed: int, folder: Path, count: int = BATCH) -> Batch:
    """Check `count` mutations in a process of its own, up to the first that is wrong."""
    gc.collect()
    gc.freeze()  # the child's collector leaves our pages alone
    read_end, write_end = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(read_end)
        try:
            _serve(target, seed, folder, count, write_end)
        finally:
            os._exit(70)  # not reached: the fuzzer itself has failed
    os.close(write_end)
    with os.fdopen(read_end, "rb") as pipe:
        told = pipe.read().decode(errors="replace")
    _, status, used = os.wait4(child, 0)
    seconds = used.ru_utime + used.ru_stime
    if not told:
        code = os.waitstatus_to_exitcode(status)
        return Batch(count, 0, f"the process ended with status {code}", seconds)
    done, accepted, wrong = json.loads(told)
    return Batch(done, accepted, wrong, seconds)


def _serve(target: Target, seed: int, folder: Path, count: int, pipe: int) -> None:
    faulthandler.dump_traceback_later(STUCK_S + count, exit=True)
    own, accepted, wrong, number = peak_mb(), 0, None, 0
    while number < count and not wrong:
        data = mutated(target.data, random.Random(f"{seed} {target.name} {number}"))
        wrong = check(target, data, folder)
        taken = peak_mb() - own
        if not wrong and taken > FLOOR + OWN_MB + PER_BYTE * len(data) / 1e6:
            wrong = f"it took {taken:.0f} MB for {len(data)} bytes"
        accepted += wrong == ""
        number += 1
    os.write(pipe, json.dumps([number, accepted, (wrong or "")[-3000:]]).encode())
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


@dataclass
class Tally:
    """Of the files of one reader."""

    done: int = 0
    accepted: int = 0
    seconds: float = 0.0

    def add(self, one: Batch) -> None:
        """Count a batch."""
        self.done += one.done
        self.accepted += one.accepted
        self.seconds += one.seconds

    @property
    def spent(self) -> float:
        """Halfway between equal numbers and equal times: readers of bags take twenty times as long
        as those of a line of text."""
        return self.done * self.seconds

    def line(self, name: str) -> str:
        """Of the table."""
        rate, share = self.done / max(self.seconds, 1e-9), self.accepted / max(self.done, 1)
        return f"{self.done:>9}  {rate:>7.0f} a CPU second  {share:>4.0%} accepted  {name}"


def run(chosen: list[Target], seconds: float, executions: float, seed: int) -> int:
    """Fuzz for some seconds, or so many files; prints findings, and a line for each reader.

    Returns the number of findings.
    """
    warnings.simplefilter("error", RuntimeWarning)
    warnings.filterwarnings("ignore", "Duplicate name", UserWarning)  # the mutator's archives
    tallies = {one.name: Tally() for one in chosen}
    kinds: Counter[str] = Counter()
    begun = told = time.monotonic()
    with place() as folder:
        for target in chosen:  # kernels compile, and modules are loaded, before memory is measured
            wrong = check(target, target.data, folder)
            assert wrong == "", f"the sample {target.name}: {wrong}"
        while True:
            target = min(chosen, key=lambda one: tallies[one.name].spent)
            done, now = sum(one.done for one in tallies.values()), time.monotonic()
            if now > begun + seconds or done >= executions or len(kinds) >= MOST_KINDS:
                break
            if now > told + TOLD_EVERY:
                told = now
                print(f"{done} files, {kinds.total()} findings, {now - begun:.0f} s", flush=True)
            seed += 1
            one = batch(target, seed, folder)
            tallies[target.name].add(one)
            if one.wrong:
                kind = f"{target.name}: {one.wrong.strip().splitlines()[-1]}"
                kinds[kind] += 1
                if kinds[kind] == 1:
                    print(f"{keep(target, folder)}:\n{one.wrong}", flush=True)
            (folder / target.name).write_bytes(target.data)
    print("\n".join(one.line(name) for name, one in tallies.items()))
    whole = sum(one.done for one in tallies.values())
    print(f"{whole:>9}  files read, {kinds.total()} findings, {time.monotonic() - begun:.0f} s")
    return kinds.total()


def main() -> None:
    """The command line."""
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    options.add_argument("--seconds", type=float, default=60.0)
    options.add_argument("--executions", type=float, default=math.inf)
    options.add_argument("--only", choices=list(targets()))
    options.add_argument("--seed", type=int, default=0)
    given = options.parse_args()
    chosen = [one for one in targets().values() if given.only in (None, one.name)]
    sys.exit(min(run(chosen, given.seconds, given.executions, given.seed), 1))


if __name__ == "__main__":
    main()
