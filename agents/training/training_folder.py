"""The folder of a training: its configuration, and the checkpoint to resume from."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from agents.training.segments import CHECKPOINT, PROGRESS, read_progress
from slam.errors import InputError
from slam.io.files import replacing
from slam.io.one_line import one_line
from slam.io.small_text import parse_text

CONFIG = "config.json"


def find_checkpoint(plain: Mapping[str, Any], folder: Path, resume: bool) -> Path | None:
    """The checkpoint to resume from; None without one. Nothing is written.

    plain   the training's configuration, as JSON reads it back
    resume  whether the folder may hold a training, which may differ in `steps` only

    Raises InputError for a folder that holds another training.
    """
    find_config(plain, folder, resume)
    checkpoint = folder / CHECKPOINT
    return checkpoint if checkpoint.exists() else None


def find_config(plain: Mapping[str, Any], folder: Path, resume: bool) -> None:
    """Raises InputError for a folder that holds another training, or one that is not to go on."""
    config = folder / CONFIG
    if config.exists():
        if not resume:
            raise InputError(
                f"{folder} holds a training: continue it by --resume, or choose another --out"
            )
        known = _read(config)
        others = [key for key in plain if key != "steps" and known.get(key) != plain[key]]
        if others:
            raise InputError(
                f"{folder} holds another training: {others[0]} is "
                f"{one_line(repr(known.get(others[0])))} there, not {plain[others[0]]!r}"
            )


def keep_config(plain: Mapping[str, Any], folder: Path) -> None:
    """Write the configuration."""
    folder.mkdir(parents=True, exist_ok=True)
    with replacing(folder / CONFIG) as file:
        file.write(json.dumps(plain, indent=2).encode())


def write_config(plain: Mapping[str, Any], folder: Path) -> None:
    """Write the configuration; remove a last line of progress that an interruption cut off."""
    keep_config(plain, folder)
    rows = read_progress(folder)
    with replacing(folder / PROGRESS) as file:
        file.write("".join(json.dumps(row) + "\n" for row in rows).encode())


def _read(config: Path) -> dict[str, Any]:
    return parse_text(config, "a configuration of a training", lambda text: dict(json.loads(text)))
