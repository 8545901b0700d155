"""Policy files: what `dynslam train` writes, read without running anything that is in them."""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import torch
from stable_baselines3.common.on_policy_algorithm import OnPolicyAlgorithm

from slam.errors import InputError
from slam.io.files import replacing

TOLD = "dynslam.json"
WEIGHTS = "policy.pth"


def save_model(model: OnPolicyAlgorithm, told: Mapping[str, Any], path: Path) -> None:
    """Write a model as stable-baselines3 does, and beside it in the file what was trained."""
    file = io.BytesIO()
    model.save(file)  # pyright: ignore[reportArgumentType]
    with zipfile.ZipFile(file, "a") as archive:
        archive.writestr(TOLD, json.dumps(told))
    with replacing(path) as out:
        out.write(file.getvalue())


def slim(path: Path, out: Path) -> None:
    """Keep of a model its weights and what was trained: enough to act, not to go on learning."""
    file = io.BytesIO()
    with zipfile.ZipFile(path) as archive, zipfile.ZipFile(file, "w") as slimmer:
        for name in (WEIGHTS, TOLD):
            stamped = zipfile.ZipInfo(name)  # of no date: the same policy, the same bytes
            slimmer.writestr(stamped, archive.read(name), zipfile.ZIP_DEFLATED)
    with replacing(out) as whole:
        whole.write(file.getvalue())


def read_policy(path: Path) -> tuple[dict[str, Any], dict[str, torch.Tensor]]:
    """What was trained, and the weights. Raises InputError for any other file."""
    try:
        with zipfile.ZipFile(path) as archive:
            told = json.loads(archive.read(TOLD))
            weights = torch.load(
                io.BytesIO(archive.read(WEIGHTS)), map_location="cpu", weights_only=True
            )
    except Exception as error:  # torch raises whatever it likes
        raise InputError(f"{path}: not a policy that dynslam train wrote ({error})") from None
    return told, weights
