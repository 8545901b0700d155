"""A network with attention between viewpoints, as a graph whose edges are the times between them.

Needs `dynslam[train]`.
"""

from __future__ import annotations

import numpy as np
import torch
from torch import Tensor, nn

from agents.viewpoints.features import ELAPSED, EXPLORING, FEATURES, SHORT_SIGHTED, TIME_SCALE
from agents.viewpoints.network import EXPLORED, FAR, SHARPNESS, WIDTH, Inputs, pooled
from slam.geometry import Array

SIZE = 32  # of a viewpoint's token
SLOPES = (0.0, 1.5)  # of the heads: how much a way of TIME_SCALE takes off the score
LAYERS = 2
FARTHEST = 4.0  # times TIME_SCALE: longer ways, and missing ones, count as this


class AttentionNetwork(nn.Module):
    """As `ViewpointNetwork`, but the choices look at each other: self-attention with a bias by the
    time from one to the other, linear and fixed, since a learned one costs a third more time."""

    def __init__(self) -> None:
        super().__init__()
        self.token = nn.Linear(FEATURES, SIZE)
        self.layers = nn.ModuleList(Layer() for _ in range(LAYERS))
        self.logit, self.bias = nn.Linear(SIZE, 1), nn.Parameter(torch.tensor(SHARPNESS))
        self.exploring = nn.Parameter(torch.tensor(EXPLORED))
        self.value = nn.Sequential(
            nn.Linear(2 * FEATURES, WIDTH), nn.ReLU(), nn.Linear(WIDTH, WIDTH), nn.ReLU(),
            nn.Linear(WIDTH, 1),
        )  # fmt: skip
        nn.init.zeros_(self.logit.weight)

    def forward(self, given: Inputs) -> tuple[Tensor, Tensor]:
        """Logits (n, v) and values (n,)."""
        assert given.ways is not None
        kept = given.fit.float()[..., None]
        tokens = self.token(given.views)
        hidden = torch.where(given.fit, 0.0, FAR)[:, None, None, :]
        edges = hidden - torch.tensor(SLOPES)[:, None, None] * given.ways[:, None]
        for layer in self.layers:
            tokens = layer(tokens, edges)
        logits = self.logit(torch.relu(tokens))[..., 0]
        early = self.exploring[0] + self.exploring[1] * given.views[..., ELAPSED]
        planned = given.views[..., SHORT_SIGHTED] + given.views[..., EXPLORING] * early
        logits = logits + self.bias * planned
        return logits.masked_fill(~given.fit, FAR), self.value(pooled(given.views, kept))[..., 0]


class Layer(nn.Module):
    """Self-attention and a layer of each token by itself, each added to the tokens."""

    def __init__(self) -> None:
        super().__init__()
        self.first, self.second = nn.LayerNorm(SIZE), nn.LayerNorm(SIZE)
        self.asked, self.joined = nn.Linear(SIZE, 3 * SIZE), nn.Linear(SIZE, SIZE)
        self.own = nn.Sequential(nn.Linear(SIZE, SIZE), nn.ReLU(), nn.Linear(SIZE, SIZE))

    def forward(self, tokens: Tensor, edges: Tensor) -> Tensor:
        """Tokens (n, v, SIZE); `edges` (n, heads, v, v) are added to the scores."""
        n, v, _ = tokens.shape
        parts = self.asked(self.first(tokens)).view(n, v, 3, len(SLOPES), SIZE // len(SLOPES))
        query, key, value = parts.permute(2, 0, 3, 1, 4)
        seen = nn.functional.scaled_dot_product_attention(query, key, value, attn_mask=edges)
        tokens = tokens + self.joined(seen.transpose(1, 2).reshape(n, v, SIZE))
        return tokens + self.own(self.second(tokens))


def ways_between(between: Array) -> Tensor:
    """(n, v + 1, v + 1) times (n, v, v), s, between viewpoints, over TIME_SCALE; 0 to and from
    exploring."""
    found = np.pad(np.minimum(between / TIME_SCALE, FARTHEST), ((0, 0), (0, 1), (0, 1)))
    return torch.from_numpy(found.astype(np.float32))
