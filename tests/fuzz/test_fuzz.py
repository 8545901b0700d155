"""A minute of the fuzzer, every finding of its past, and whether it finds what it is to find."""

import io
import os
import random
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from slam.episode import Episode
from slam.errors import InputError
from slam.trajectory import Trajectory
from tests.fuzz import fuzz
from tests.fuzz.mutate import _in_array, mutated
from tests.fuzz.oracles import assert_episode, assert_kept, episode_again
from tests.fuzz.targets import Target, targets
from tests.slam.io.samples import small_drive

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


def test_an_array_that_is_changed_stays_small() -> None:
    """The fuzzer took its own 1.5 GB for that of the reader."""
    file = io.BytesIO()
    np.save(file, np.zeros((2, 2, 2, 2), np.uint8))
    made = [len(_in_array(file.getvalue(), random.Random(seed))) for seed in range(4000)]
    assert 5e5 < max(made) < 1e6 + 1000


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


def test_wrong_results_are_found() -> None:
    drive = small_drive()
    assert_episode(drive)
    for wrong in (
        replace(drive, scans=drive.scans[::-1]),
        replace(drive, scans=(drive.scans[0], drive.scans[0])),
    ):
        with pytest.raises(AssertionError, match="stamps"):
            assert_episode(wrong)


def test_what_is_lost_on_the_way_to_a_file_and_back_is_found(tmp_path: Path) -> None:
    drive, path = small_drive(), tmp_path / "again.npz"
    assert_kept(drive, episode_again, path)
    assert not path.exists()

    def rounded(episode: Episode, path: Path) -> Episode:
        other = episode_again(episode, path)
        return replace(
            other, odometry=Trajectory(other.odometry.times, other.odometry.poses + 1e-12)
        )

    with pytest.raises(AssertionError, match="poses"):
        assert_kept(drive, rounded, path)
    with pytest.raises(AssertionError, match="seed"):
        assert_kept(drive, lambda one, _: replace(one, meta={"seed": 2}), path)
