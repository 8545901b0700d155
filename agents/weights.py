"""Weights of networks that come from a file."""

from __future__ import annotations

from collections.abc import Mapping

import torch

from slam.io.one_line import one_line

MAX_WEIGHT = 1e6  # larger ones overflow within a few layers: a score or an action is no number


def check_weights(weights: Mapping[str, torch.Tensor]) -> None:
    """Raises ValueError for weights that are NaN or beyond MAX_WEIGHT."""
    for name, values in weights.items():
        if not bool((values.abs() <= MAX_WEIGHT).all()):
            raise ValueError(f"{one_line(name, 60)} holds NaN or a number beyond {MAX_WEIGHT:g}")
