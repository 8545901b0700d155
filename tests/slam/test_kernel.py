"""The cache of compiled kernels notices every edit that changes what a kernel does."""

import ast
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

from numba import njit

import dynslam_env
import slam
from slam.kernel import Stopwatch, kernel
from slam.maps import rays, tiles

MAX_ARGUMENTS = 12

CALLEE = """
from typing import NamedTuple

from slam.kernel import kernel

FACTOR = 10

class Pair(NamedTuple):
    first: int
    second: int

@kernel
def scaled(x):
    return 2 * x
"""
MIDDLE = """
from callee import scaled
from slam.kernel import kernel

@kernel
def middle(x):
    return scaled(x)
"""
CALLER = """
from callee import FACTOR, Pair
from middle import middle
from slam.kernel import kernel

@kernel
def caller(pair: Pair):
    return FACTOR * middle(pair.first)

print(caller(Pair(first=1, second=2)), caller.stats.cache_hits[caller.signatures[0]])
"""


def called(folder: Path) -> tuple[int, bool]:
    """What a new process computes, and whether it found the kernel in the cache."""
    command = [sys.executable, "-B", "caller.py"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True)
    value, hits = done.stdout.split()
    return int(value), hits != "0"


EDITS = [  # of CALLEE: before, after, and what is computed then
    ("2 * x", "3 * x", 30),
    ("FACTOR = 10", "FACTOR = 100", 200),
    ("first: int\n    second: int", "second: int\n    first: int", 20),
]


def test_a_kernel_is_compiled_again_after_an_edit_in_another_file_and_only_then(
    tmp_path: Path,
) -> None:
    for name, text in (("callee", CALLEE), ("middle", MIDDLE), ("caller", CALLER)):
        (tmp_path / f"{name}.py").write_text(text)
    assert called(tmp_path) == (20, False)
    assert called(tmp_path) == (20, True)
    for before, after, result in EDITS:
        (tmp_path / "callee.py").write_text(CALLEE.replace(before, after))
        assert called(tmp_path) == (result, False), after


SHARED = """
import sys
import numpy as np
from slam.kernel import kernel

@kernel
def summed(a):
    return np.cumsum(a)

print("ready", flush=True)
sys.stdin.readline()
assert summed(np.ones(2))[1] == 2.0
print(sum(summed.stats.cache_misses.values()))
"""


def test_of_processes_that_begin_together_one_compiles_and_the_others_wait(tmp_path: Path) -> None:
    """Each compiled for itself: after an installation, the demo took 15 s longer."""
    (tmp_path / "shared.py").write_text(SHARED)
    begun = [
        subprocess.Popen([sys.executable, "-B", "shared.py"], cwd=tmp_path, text=True,
                         stdin=subprocess.PIPE, stdout=subprocess.PIPE) for _ in range(2)
    ]  # fmt: skip
    for one in begun:
        assert one.stdout is not None
        assert one.stdout.readline() == "ready\n"
    for one in begun:
        assert one.stdin is not None
        one.stdin.write("\n")
        one.stdin.flush()
    compiled = [int(one.communicate(timeout=100)[0]) for one in begun]
    assert sorted(compiled) == [0, 1]


def test_the_kernels_of_a_module_that_were_imported_are_known_to_all_of_its_own() -> None:
    own = rays._trace._cache._cache_file._source_stamp
    imported = tiles.next_slot._cache._cache_file._source_stamp
    assert ("next_slot", imported) in own


def sources() -> Iterator[tuple[Path, str]]:
    """All files of the packages that have kernels, and their texts."""
    for package in (slam, dynslam_env):
        for path in Path(package.__path__[0]).rglob("*.py"):
            yield path, path.read_text(encoding="utf-8")


def kernels() -> Iterator[tuple[str, ast.FunctionDef]]:
    """All functions decorated with `kernel`, named by file and function."""
    for path, text in sources():
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.FunctionDef):
                decorators = [getattr(d, "func", d) for d in node.decorator_list]
                if any(isinstance(d, ast.Name) and d.id == "kernel" for d in decorators):
                    yield f"{path}:{node.name}", node


def test_every_kernel_is_made_here() -> None:
    """numba's own `njit` does not notice edits in other files."""
    for path, text in sources():
        assert ("njit" in text) == (path.name == "kernel.py"), path


def test_no_kernel_takes_too_many_arguments() -> None:
    """What belongs together is one NamedTuple of arrays."""
    found = {name: node.args for name, node in kernels()}
    assert len(found) > 100
    for name, args in found.items():
        names = [*args.posonlyargs, *args.args, *args.kwonlyargs]
        assert len(names) <= MAX_ARGUMENTS, name


def test_options_are_those_of_numba() -> None:
    @kernel(error_model="numpy")
    def quotient(a, b):
        return a / b

    assert quotient(1.0, 0.0) == float("inf")


def test_a_stopwatch_counts_compiling_and_not_running() -> None:
    watch = Stopwatch("numba:compile")

    @njit
    def inner(x):
        return x + 1

    @njit
    def outer(x):
        return 2 * inner(x)

    begun = time.perf_counter()
    assert outer(1) == 4  # compiles two kernels, one within the other
    taken = time.perf_counter() - begun
    assert 0.01 < watch.seconds <= taken
    compiled = watch.seconds
    assert outer(2) == 6
    assert watch.seconds == compiled
