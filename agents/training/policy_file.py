"""Policy files of `dynslam train`, read without running code from them."""

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

TRAINING_MEMBER = "dynslam.json"
WEIGHTS_MEMBER = "policy.pth"


def save_model(model: OnPolicyAlgorithm, training: Mapping[str, Any], path: Path) -> None:
    """Write a model as stable-baselines3 does, with the training's configuration added to it."""
    file = io.BytesIO()
    model.save(file)  # pyright: ignore[reportArgumentType]
    with zipfile.ZipFile(file, "a") as archive:
        archive.writestr(TRAINING_MEMBER, json.dumps(training))
    with replacing(path) as out:
        out.write(file.getvalue())


def write_slim(path: Path, out: Path) -> None:
    """Copy only the weights and the configuration of a model: enough to act, not to resume."""
    file = io.BytesIO()
    with zipfile.ZipFile(path) as archive, zipfile.ZipFile(file, "w") as slimmer:
        for name in (WEIGHTS_MEMBER, TRAINING_MEMBER):
            stamped = zipfile.ZipInfo(name)  # without a date: the same policy, the same bytes
            slimmer.writestr(stamped, archive.read(name), zipfile.ZIP_DEFLATED)
    with replacing(out) as whole:
        whole.write(file.getvalue())


def read_policy(path: Path) -> tuple[dict[str, Any], dict[str, torch.Tensor]]:
    """The training's configuration, and the weights. Raises InputError for any other file."""
    try:
        with zipfile.ZipFile(path) as archive:
            training = json.loads(archive.read(TRAINING_MEMBER))
            weights = torch.load(
                io.BytesIO(archive.read(WEIGHTS_MEMBER)), map_location="cpu", weights_only=True
            )
    except Exception as error:  # torch raises many types
        raise InputError(f"{path}: not a policy of dynslam train ({error})") from None
    return training, weights
