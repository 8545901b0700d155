"""Where a command puts its files."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

from slam.errors import InputError
from slam.io.files import replacing


def output_directory(path: Path) -> Path:
    """`path`, made if need be, and found to be writable before hours of work go by."""
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


def write_json(values: Mapping[str, Any], path: Path) -> None:
    """A JSON object as a file that is there whole or not at all."""
    with replacing(path) as file:
        file.write((json.dumps(dict(values), indent=2, allow_nan=False) + "\n").encode())


def write_png(figure: Figure, path: Path) -> None:
    """A figure as PNG; no date in it, so that the same figure gives the same bytes."""
    with replacing(path) as file:
        figure.savefig(file, format="png", metadata={"Software": None})
