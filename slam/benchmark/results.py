"""Results as append-only JSON lines: a killed run loses at most the line being written."""

from __future__ import annotations

import json
import math
import os
import platform
import subprocess
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, NoReturn

from slam.errors import InputError
from slam.io.files import MAX_LINE, lines
from slam.io.guard import guarded, take
from slam.io.one_line import one_line

MAX_DIGITS = 18  # of a whole number: those of 64 bits
JSON_BYTES = 30  # of memory that a byte of JSON takes at most
Result = dict[str, Any]
"""One run: flat scores by name, with the configuration and origin of the run."""

PACKAGES = ("dynslam", "numpy", "numba", "scipy", "gymnasium", "pymunk")


def versions() -> dict[str, str]:
    """The versions that a result depends on."""
    return {"python": platform.python_version()} | {name: _version(name) for name in PACKAGES}


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "absent"


@cache
def origin() -> Result:
    """The origin of a result beside its configuration: `versions`, the `commit` of a checkout (with
    `-dirty` if files differ from it; None in an installed package), and the `host`."""
    return {"versions": versions(), "commit": _commit(), "host": _host()}


def _commit() -> str | None:
    home = Path(__file__).resolve().parents[2]
    if not (home / ".git").exists():
        return None
    command = ["git", "-C", str(home), "describe", "--always", "--dirty", "--abbrev=12"]
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return None


def _host() -> Result:
    machine = f"{platform.system()} {platform.machine()}"
    return {"name": platform.node(), "machine": machine, "cores": os.cpu_count()}


def append(path: Path, result: Result) -> None:
    """Append one result as a line, and sync the file to disk.

    An unfinished last line of a killed run is removed first.
    """
    line = json.dumps(result, allow_nan=False) + "\n"
    if path.exists() and not _ends_with_a_line(path):
        os.truncate(path, path.read_bytes().rfind(b"\n") + 1)
    with path.open("a", encoding="utf-8", newline="\n") as file:
        file.write(line)
        file.flush()
        os.fsync(file.fileno())


def _ends_with_a_line(path: Path) -> bool:
    with path.open("rb") as file:
        if file.seek(0, os.SEEK_END) == 0:
            return True
        file.seek(-1, os.SEEK_END)
        return file.read() == b"\n"


def read(path: Path) -> list[Result]:
    """All complete results of a file; an unfinished last line of a killed run is ignored.

    Raises InputError for any other line that is not JSON, and for a file that cannot be read.
    """
    found: list[Result] = []
    with guarded(path):
        for number, line in lines(path):
            if len(line) >= MAX_LINE:
                raise InputError(f"{path}:{number}: a line of over {MAX_LINE >> 20} MB")
            if line.endswith(b"\n") and line != b"\n":
                take(JSON_BYTES * len(line))
                found.append(_row(line, f"{path}:{number}"))
    return found


def _row(line: bytes, where: str) -> Result:
    try:
        row = json.loads(
            line.decode(), parse_constant=_no_number, parse_int=_whole, parse_float=_finite
        )
    except (ValueError, RecursionError) as error:  # ValueError: UnicodeDecodeError, JSONDecodeError
        raise InputError(f"{where}: not a line of results ({one_line(error)})") from None
    if not isinstance(row, dict):
        raise InputError(f"{where}: not a line of results (no object of JSON)")
    return row


def _whole(text: str) -> int:
    if len(text) > MAX_DIGITS:
        raise ValueError(f"a whole number of {len(text)} digits")
    return int(text)


def _finite(text: str) -> float:
    if math.isinf(float(text)):
        raise ValueError(f"{one_line(text, 60)} is no finite number")
    return float(text)


def _no_number(name: str) -> NoReturn:
    raise ValueError(f"{name} is no JSON")
