"""Results as append-only JSON lines: a killed run loses at most the line that it was writing."""

from __future__ import annotations

import json
import os
import platform
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

Result = dict[str, Any]
"""One run: flat scores by name, and what made them."""

PACKAGES = ("dynslam", "numpy", "numba", "scipy", "gymnasium", "pymunk")


def versions() -> dict[str, str]:
    """The versions that a result depends on."""
    return {"python": platform.python_version()} | {name: _version(name) for name in PACKAGES}


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "absent"


def append(path: Path, result: Result) -> None:
    """Add one result as one line, and see that it reaches the disk.

    A last line that a killed run left unfinished is cut off first.
    """
    line = json.dumps(result, allow_nan=False) + "\n"
    if path.exists() and not _ends_with_a_line(path):
        os.truncate(path, path.read_bytes().rfind(b"\n") + 1)
    with path.open("a", encoding="utf-8") as file:
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
    """All whole results of a file; a last line that a killed run left unfinished is passed over."""
    lines = path.read_text(encoding="utf-8").split("\n")
    return [json.loads(line) for line in lines[:-1] if line]
