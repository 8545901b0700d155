"""A network with a memory of the decisions before. Needs `dynslam[train]`."""

from __future__ import annotations

import torch
from torch import Tensor, nn

from agents.viewpoints.features import FEATURES
from agents.viewpoints.network import WIDTH, Inputs, ViewpointNetwork, pooled

MEMORY = 32


class RecurrentNetwork(ViewpointNetwork):
    """As `ViewpointNetwork`, with a gated recurrent unit that is told each situation and choice."""

    def __init__(self) -> None:
        super().__init__()
        self.cell = nn.GRUCell(3 * FEATURES, MEMORY)
        self.recalled = nn.Linear(MEMORY, WIDTH)
        self.value = nn.Sequential(
            nn.Linear(2 * FEATURES + MEMORY, WIDTH), nn.ReLU(), nn.Linear(WIDTH, WIDTH), nn.ReLU(),
            nn.Linear(WIDTH, 1),
        )  # fmt: skip

    def shift(self, around: Tensor, given: Inputs) -> Tensor:
        """See `ViewpointNetwork`."""
        assert given.memory is not None
        return super().shift(around, given) + self.recalled(given.memory)

    def known(self, given: Inputs) -> Tensor:
        """See `ViewpointNetwork`."""
        assert given.memory is not None
        return torch.cat([super().known(given), given.memory], dim=-1)

    def remember(self, given: Inputs, actions: Tensor, memory: Tensor) -> Tensor:
        """The memory (n, MEMORY) after a choice (n,)."""
        return self.cell(self.told(given, actions), memory)

    def told(self, given: Inputs, actions: Tensor) -> Tensor:
        """(n, 3 FEATURES) what the memory is told."""
        chosen = given.views[torch.arange(len(actions)), actions]
        return torch.cat([pooled(given.views, given.fit.float()[..., None]), chosen], dim=-1)

    def recall(self, told: Tensor, over: Tensor, memory: Tensor) -> Tensor:
        """(k, n, MEMORY) the memory before each of k decisions in a row of n patrols.

        told    (k, n, 3 FEATURES)
        over    (k, n) 1 where the episode ended with the decision
        memory  (n, MEMORY) before the first
        """
        found = []
        for row, ended in zip(told, over, strict=True):
            found.append(memory)
            memory = self.cell(row, memory) * (1.0 - ended)[:, None]
        return torch.stack(found)
