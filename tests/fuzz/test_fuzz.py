"""A minute of the fuzzer, every finding of its past, and whether it finds what it is to find."""

import os
import random
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from slam.errors import InputError
from tests.fuzz import fuzz
from tests.fuzz.mutate import mutated
from tests.fuzz.targets import Target, targets

EXECUTIONS = 100  # of each kind of file
SEED = 20_000  # other files than those of a run of the fuzzer that begins at 0
KEPT = sorted(fuzz.FINDINGS.glob("*")) if fuzz.FINDINGS.is_dir() else []


@pytest.fixture(scope="module")
def folder() -> Iterator[Path]:
    with fuzz.place() as made:
        yield made


@pytest.mark.filterwarnings("error::RuntimeWarning", "ignore:Duplicate name:UserWarning")
@pytest.mark.parametrize("name", list(targets()))
def test_files_that_nobody_would_write(folder: Path, name: str) -> None:
    target = targets()[name]
    assert not fuzz.check(target, target.data, folder), "the sample itself is read"
    for number in range(EXECUTIONS):
        data = mutated(target.data, random.Random(f"{SEED} {name} {number}"))
        assert not fuzz.check(target, data, folder), f"mutation {number}"
    (folder / name).write_bytes(target.data)


@pytest.mark.filterwarnings("error::RuntimeWarning")
@pytest.mark.parametrize("path", KEPT, ids=lambda path: path.name)
def test_what_was_found_once(folder: Path, path: Path) -> None:
    target = targets()[path.name.partition("-")[2]]
    assert not fuzz.check(target, target.data, folder), "what is loaded at the first use"
    assert not fuzz.check(target, path.read_bytes(), folder)
    (folder / target.name).write_bytes(target.data)


def refuse(path: Path) -> None:
    raise InputError("it is not said which file")


def crash(path: Path) -> None:
    os._exit(7)  # as a kernel ends the process that writes beside its arrays


def fill(path: Path) -> None:
    bytearray(400 << 20)


def hang(path: Path) -> None:
    begun = time.process_time()
    while time.process_time() < begun + 2 * fuzz.LIMIT_S:
        pass


@pytest.mark.parametrize(
    ("read", "wrong"),
    [
        (refuse, "the message is"),
        (crash, "ended with status 7"),
        (fill, "it took 4"),
        (hang, "TooSlowError"),
        (lambda path: 1 / 0, "ZeroDivisionError"),
        (lambda path: path.read_bytes(), ""),
    ],
)
def test_the_fuzzer_finds_what_it_is_to_find(
    tmp_path: Path, read: Callable[[Path], object], wrong: str
) -> None:
    found = fuzz.batch(Target("some.log", b"ODOM 1 2 3", read), 0, tmp_path, 3)
    assert wrong in found.wrong
    assert bool(found.wrong) == bool(wrong)
    assert found.done == (1 if wrong and "status" not in wrong else 3)
    assert found.accepted == (0 if wrong else 3)
