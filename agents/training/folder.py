"""The folder of a training: what is trained there, and what there is to go on from."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from agents.training.legs import CHECKPOINT, PROGRESS, read_progress
from slam.errors import InputError
from slam.io.files import replacing

CONFIG = "config.json"


def checkpoint_of(plain: Mapping[str, Any], folder: Path, resume: bool) -> Path | None:
    """The checkpoint to go on from, if there is one; nothing is written.

    plain   what is trained, as JSON gives it back
    resume  whether there may be a training already: the same, but for its `steps`
    """
    config, checkpoint = folder / CONFIG, folder / CHECKPOINT
    if config.exists():
        if not resume:
            raise InputError(f"{folder} holds a training: --resume goes on, --out takes another")
        known = _read(config)
        others = [key for key in plain if key != "steps" and known.get(key) != plain[key]]
        if others:
            raise InputError(
                f"{folder} holds another training: {others[0]} is {known.get(others[0])!r} there, "
                f"not {plain[others[0]]!r}"
            )
    return checkpoint if checkpoint.exists() else None


def make_ready(plain: Mapping[str, Any], folder: Path) -> None:
    """Take down what is trained; a line of progress that was cut off when the training was broken
    off is left out."""
    folder.mkdir(parents=True, exist_ok=True)
    with replacing(folder / CONFIG) as file:
        file.write(json.dumps(plain, indent=2).encode())
    rows = read_progress(folder)
    with replacing(folder / PROGRESS) as file:
        file.write("".join(json.dumps(row) + "\n" for row in rows).encode())


def _read(config: Path) -> dict[str, Any]:
    try:
        return dict(json.loads(config.read_text(encoding="utf-8")))
    except (TypeError, ValueError) as error:
        raise InputError(f"{config}: not what a training writes ({error})") from None
