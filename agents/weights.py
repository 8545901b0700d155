"""Weights of networks that come from a file."""

from __future__ import annotations

from collections.abc import Mapping

import torch

from slam.io.guard import take
from slam.io.one_line import one_line

MAX_WEIGHT = 1e6  # larger ones overflow within a few layers: a score or an action is no number


def check_weights(weights: Mapping[str, torch.Tensor]) -> None:
    """Raises ValueError for weights that are NaN or beyond MAX_WEIGHT, InputError for more of them
    than the file being read has room for."""
    for name, values in weights.items():
        take(values.numel() * values.element_size())  # a stride of 0 makes many of one number
        if not bool((values.abs() <= MAX_WEIGHT).all()):
            raise ValueError(f"{one_line(name, 60)} holds NaN or a number beyond {MAX_WEIGHT:g}")
