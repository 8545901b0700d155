"""Folders and files that a command writes."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from slam.errors import InputError
from slam.io.files import replacing

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def output_directory(path: Path) -> Path:
    """`path` as a writable folder, made if it is missing. Raises InputError.

    Called before any work, so that a long run does not fail at its end.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path):
            return path
    except OSError as error:
        taken = path.exists() and not path.is_dir()
        reason = "it is a file" if taken else error.strerror or str(error)
        raise InputError(
            f"{path}: a directory that can be written was expected ({reason})"
        ) from None


def own_directory(path: Path) -> Path:
    """`output_directory` that no other process writes to until this one has ended, killed or not.
    Raises InputError if another has it. Windows, and some disks on a network, have no such lock."""
    output_directory(path)
    with suppress(ImportError):
        import fcntl

        real = path.resolve()
        if real not in _locks:
            handle = os.open(real, os.O_RDONLY)
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                os.close(handle)
                raise InputError(
                    f"{path}: another dynslam is writing to it; wait, or choose another --out"
                ) from None
            except OSError:  # a disk without locks
                pass
            _locks[real] = handle
    return path


_locks: dict[Path, int] = {}  # folder -> open file, which holds the lock as long as it is open


def write_json(values: Mapping[str, Any], path: Path) -> None:
    """Write a JSON object atomically: the file is complete or absent."""
    with replacing(path) as file:
        file.write((json.dumps(dict(values), indent=2, allow_nan=False) + "\n").encode())


def write_png(figure: Figure, path: Path) -> None:
    """Write a figure as PNG, without a date: the same figure gives the same bytes."""
    engine = figure.get_layout_engine()
    if engine is not None:
        engine.execute(figure)
        figure.set_layout_engine(None)  # else all is drawn twice, first for the layout
    with replacing(path) as file:
        figure.savefig(file, format="png", metadata={"Software": None})
