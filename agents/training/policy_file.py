"""Policy files of `dynslam train`, read without running code from them."""

from __future__ import annotations

import io
import json
import pickletools
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import torch
from stable_baselines3.common.on_policy_algorithm import OnPolicyAlgorithm

from agents.weights import check_weights
from slam.errors import InputError
from slam.io.archive import check_packing, read_member
from slam.io.files import reading, replacing
from slam.io.guard import guarded, take
from slam.io.one_line import one_line
from slam.validation import whole_number

TRAINING_MEMBER = "dynslam.json"
WEIGHTS_MEMBER = "policy.pth"
OPTIMISER_MEMBER = "policy.optimizer.pth"
PLAIN = {"algorithm": "ppo", "env": "a plain file", "settings": {"policy": "MultiInputPolicy"}}
"""The configuration of a file of stable-baselines3 that says nothing of its training."""
DATA_MEMBER = "data"  # JSON of stable-baselines3, most of it pickled
COUNTS = ("num_timesteps", "_n_updates", "_episode_num")  # in it: how far a training is
COPIES = 3  # of a member: as it is read, as tensors, and in the policy
ALLOWED = (
    "collections OrderedDict", "torch._utils _rebuild_tensor_v2",
    *(f"torch {kind}Storage" for kind in ("Float", "Double", "Long", "Int", "Bool")),
)  # fmt: skip
"""What the pickle of weights may name: torch itself would also make a bytearray of any size."""


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
    """The training's configuration, and the weights. Raises InputError for any other file.

    A plain file of stable-baselines3 counts as PPO with the usual MultiInputPolicy: its own
    configuration is pickled, and is not read.
    """
    with opened(path, "a policy of dynslam train") as archive:
        plain = TRAINING_MEMBER not in archive.namelist() and DATA_MEMBER in archive.namelist()
        training = PLAIN if plain else json.loads(read_member(archive, TRAINING_MEMBER, COPIES))
        weights = _tensors(archive, WEIGHTS_MEMBER)
        if not (isinstance(training, dict) and isinstance(weights, dict)):
            raise TypeError("no configuration and weights")
        check_weights(weights)
        return training, weights


def restore(model: OnPolicyAlgorithm, path: Path) -> None:
    """Bring a new model to the state of a checkpoint: weights, the optimiser's moments, and how far
    it is. All else is that of the new model: what stable-baselines3 pickles into the file is not
    read, since reading it would run code. Raises InputError for any other file."""
    with opened(path, "a checkpoint to resume from") as archive:
        told = json.loads(read_member(archive, DATA_MEMBER, COPIES))
        counts = {name: told[name] for name in COUNTS}
        for name, count in counts.items():
            whole_number(name, count, 0)
        weights = _tensors(archive, WEIGHTS_MEMBER)
        check_weights(weights)
        model.policy.load_state_dict(weights)
        _restore_moments(model.policy.optimizer, _tensors(archive, OPTIMISER_MEMBER)["state"])
        vars(model).update(counts)


def _restore_moments(optimiser: torch.optim.Optimizer, moments: Mapping[int, Any]) -> None:
    groups = optimiser.state_dict()["param_groups"]
    parameters = [one for group in optimiser.param_groups for one in group["params"]]
    for at, state in moments.items():
        for name in state:
            value = state[name]
            if value.shape not in (parameters[at].shape, torch.Size()) or value.is_complex():
                raise ValueError(f"{name} of shape {tuple(value.shape)}")
        _check_finite(state)
    optimiser.load_state_dict({"state": moments, "param_groups": groups})


def _check_finite(tensors: Mapping[str, torch.Tensor]) -> None:
    for name, values in tensors.items():
        if not bool(values.isfinite().all()):
            raise ValueError(f"{one_line(name, 60)} holds NaN or infinity")


@contextmanager
def opened(path: Path, what: str) -> Iterator[zipfile.ZipFile]:
    """An archive whose members are to be read; whatever is raised then becomes InputError."""
    with guarded(path), reading(path) as file:
        try:
            with zipfile.ZipFile(file) as archive:
                check_packing(archive)
                yield archive
        except Exception as error:  # torch raises many types
            raise InputError(f"not {what} ({one_line(error)})") from None


def _tensors(archive: zipfile.ZipFile, name: str) -> Any:
    """What torch saved in a member: tensors, numbers, and containers of them."""
    data = read_member(archive, name, COPIES)
    with zipfile.ZipFile(io.BytesIO(data)) as packed:
        check_packing(packed)
        for member in packed.infolist():
            take(COPIES * member.file_size)
        (pickled,) = (one for one in packed.namelist() if one.endswith("/data.pkl"))
        for operation, argument, _ in pickletools.genops(read_member(packed, pickled, 1)):
            if "GLOBAL" in operation.name and argument not in ALLOWED:
                raise ValueError(f"{argument} in it, where tensors alone are expected")
    return torch.load(io.BytesIO(data), map_location="cpu", weights_only=True)
