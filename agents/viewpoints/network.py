"""The network of the learned policy: attention over viewpoints, each with the doorways it shows.

Its size depends neither on the number of viewpoints nor of doorways: a doorway is encoded by
itself, a viewpoint gets the sum over the doorways that it shows, and viewpoints attend to each
other the less, the farther apart they are. Needs `dynslam[train]`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor, nn

from agents.viewpoints.policies.greedy import rates
from agents.viewpoints.situation import Situation
from dynslam_env.navigation.door_belief import HORIZONS
from slam.geometry import Array

WIDTH = 48  # of all layers
DOOR_FEATURES = 2 + 2 * len(HORIZONS)
VIEW_FEATURES = 4
TIME_SCALE = 30.0  # s
AGE_SCALE = 60.0  # s
ERROR_SCALE = 4.0  # brings squared errors, at most 0.25, to 1
POOLED = 0.3  # weight of each doorway in a viewpoint's sum
SHARPNESS = 8.0  # of the choice by saved error per second, with which learning begins
FAR = -1e9  # logit of a viewpoint that cannot be reached


class Inputs(NamedTuple):
    """What the network reads of n situations with v viewpoints and d doorways.

    doors   (n, d, DOOR_FEATURES)
    real    (n, d) 1 where there is a doorway
    views   (n, v, VIEW_FEATURES)
    sees    (n, v, d)
    apart   (n, v, v) times between viewpoints, over TIME_SCALE
    fit     (n, v) whether a viewpoint can be reached
    """

    doors: Tensor
    real: Tensor
    views: Tensor
    sees: Tensor
    apart: Tensor
    fit: Tensor


def inputs(situation: Situation, real: Array) -> Inputs:
    """The inputs of a situation whose arrays have a leading axis n; `real` (n, d) doorways."""
    doors, fit = situation.doors, np.isfinite(situation.times)
    gone = 1.0 - np.exp(-doors.age / AGE_SCALE)
    known = np.stack([doors.closed, gone], axis=-1)
    described = [known, ERROR_SCALE * doors.stale, ERROR_SCALE * doors.fresh]
    times = np.where(fit, situation.times, 10 * TIME_SCALE)
    sees = situation.sees * real[:, None]
    value = np.where(fit, rates(situation), 0.0)
    best = np.maximum(value.max(axis=1, keepdims=True), 1e-6)
    views = [times / TIME_SCALE, 3.0 / times, value / best, sees.sum(axis=-1) / 4.0]
    apart = np.where(np.isfinite(situation.between), situation.between, 300.0) / TIME_SCALE
    parts = (np.concatenate(described, axis=-1), real, np.stack(views, axis=-1), sees, apart)
    read = [torch.from_numpy(part.astype(np.float32)) for part in parts]
    return Inputs(read[0], read[1], read[2], read[3], read[4], torch.from_numpy(fit))


class ViewpointNetwork(nn.Module):
    """Logits of the viewpoints, and the value of a situation."""

    def __init__(self) -> None:
        super().__init__()
        self.door = nn.Sequential(
            nn.Linear(DOOR_FEATURES, WIDTH), nn.ReLU(), nn.Linear(WIDTH, WIDTH), nn.ReLU()
        )
        self.view = nn.Sequential(
            nn.Linear(VIEW_FEATURES + WIDTH, WIDTH), nn.ReLU(), nn.Linear(WIDTH, WIDTH)
        )
        self.attended = nn.Linear(WIDTH, 3 * WIDTH)
        self.distance = nn.Parameter(torch.tensor(0.5))
        self.mixed = nn.Sequential(nn.ReLU(), nn.Linear(2 * WIDTH, WIDTH), nn.ReLU())
        self.logit, self.bias = nn.Linear(WIDTH, 1), nn.Parameter(torch.tensor(SHARPNESS))
        self.value = nn.Sequential(nn.Linear(2 * WIDTH, WIDTH), nn.ReLU(), nn.Linear(WIDTH, 1))
        nn.init.zeros_(self.logit.weight)  # it begins as a soft `Greedy`

    def forward(self, given: Inputs) -> tuple[Tensor, Tensor]:
        """Logits (n, v) and values (n,)."""
        doors = self.door(given.doors) * given.real[..., None]
        shown = POOLED * given.sees @ doors
        views = self.view(torch.cat([given.views, shown], dim=-1))
        views = self.mixed(torch.cat([views, self._attention(views, given)], dim=-1))
        logits = self.logit(views)[..., 0] + self.bias * given.views[..., 2]
        pooled = POOLED * doors.sum(dim=1)
        weights = given.fit.float()[..., None]
        mean = (views * weights).sum(dim=1) / weights.sum(dim=1).clamp(min=1.0)
        # values are read from what the choice needs, and do not change it
        value = self.value(torch.cat([pooled, mean], dim=-1).detach())[..., 0]
        return logits.masked_fill(~given.fit, FAR), value

    def _attention(self, views: Tensor, given: Inputs) -> Tensor:
        query, key, content = self.attended(views).chunk(3, dim=-1)
        near = query @ key.transpose(1, 2) / WIDTH**0.5 - self.distance * given.apart
        near = near.masked_fill(~given.fit[:, None], FAR)
        return torch.softmax(near, dim=-1) @ content
