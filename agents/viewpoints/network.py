"""The network of the learned policy: scores each viewpoint by its features and those of all.

Its size depends neither on the number of viewpoints nor of doorways: each viewpoint is encoded by
itself, and compared with the mean and the maximum of all. Needs `dynslam[train]`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor, nn

from agents.viewpoints.features import ELAPSED, EXPLORING, FEATURES, SHORT_SIGHTED
from slam.geometry import Array

WIDTH = 48  # of all layers
SHARPNESS = 8.0  # of the choice by saved error per second, with which learning begins
EXPLORED = (1.5, -5.0)  # the choice to explore then: equal to the best viewpoint after a tenth
FAR = -1e9  # logit of a viewpoint that cannot be reached


class Inputs(NamedTuple):
    """What the network reads of n situations with v viewpoints.

    views  (n, v, FEATURES), rows of viewpoints that cannot be reached are 0
    fit    (n, v) whether a viewpoint can be reached
    """

    views: Tensor
    fit: Tensor


def inputs(features: Array, fit: np.ndarray) -> Inputs:
    """The inputs of features (n, v, FEATURES); `fit` (n, v) viewpoints that can be reached."""
    return Inputs(torch.from_numpy(features.astype(np.float32)), torch.from_numpy(fit.copy()))


class ViewpointNetwork(nn.Module):
    """Logits of the viewpoints, and the value of a situation, each by layers of its own."""

    def __init__(self) -> None:
        super().__init__()
        self.view = nn.Sequential(
            nn.Linear(FEATURES, WIDTH), nn.ReLU(), nn.Linear(WIDTH, WIDTH), nn.ReLU()
        )
        self.mixed = nn.Sequential(nn.Linear(3 * WIDTH, WIDTH), nn.ReLU())
        self.logit, self.bias = nn.Linear(WIDTH, 1), nn.Parameter(torch.tensor(SHARPNESS))
        self.exploring = nn.Parameter(torch.tensor(EXPLORED))
        self.value = nn.Sequential(
            nn.Linear(2 * FEATURES, WIDTH), nn.ReLU(), nn.Linear(WIDTH, WIDTH), nn.ReLU(),
            nn.Linear(WIDTH, 1),
        )  # fmt: skip
        nn.init.zeros_(self.logit.weight)  # it begins as a soft choice by saved error per second

    def forward(self, given: Inputs) -> tuple[Tensor, Tensor]:
        """Logits (n, v) and values (n,)."""
        kept = given.fit.float()[..., None]
        views = self.view(given.views) * kept
        logits = self.logit(self._mixed(views, _pooled(views, kept)))[..., 0]
        early = self.exploring[0] + self.exploring[1] * given.views[..., ELAPSED]
        planned = given.views[..., SHORT_SIGHTED] + given.views[..., EXPLORING] * early
        logits = logits + self.bias * planned
        return logits.masked_fill(~given.fit, FAR), self.value(_pooled(given.views, kept))[..., 0]

    def _mixed(self, views: Tensor, around: Tensor) -> Tensor:
        """(n, v, WIDTH) each viewpoint (n, v, WIDTH) with what is around it (n, 2 WIDTH): the layer
        of both in a row, but the part of `around` is computed once for all viewpoints."""
        layer = self.mixed[0]
        assert isinstance(layer, nn.Linear)
        own, shared = layer.weight.split((WIDTH, 2 * WIDTH), dim=1)
        shift = nn.functional.linear(around, shared, layer.bias)
        return self.mixed[1](nn.functional.linear(views, own) + shift[:, None])


def _pooled(rows: Tensor, kept: Tensor) -> Tensor:
    """(n, 2 k) mean and maximum of the rows (n, v, k) that are kept (n, v, 1); others are 0."""
    mean = rows.sum(dim=1) / kept.sum(dim=1).clamp(min=1.0)
    return torch.cat([mean, rows.amax(dim=1)], dim=-1)
