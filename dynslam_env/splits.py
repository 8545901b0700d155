"""Named splits of episodes: train, validation and test, which share no random stream."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

SPLITS = ("train", "validation", "test")
SPLIT_ENTROPY = 20_061_108  # of all splits; another number would be other worlds for ever
MAX_INDEX = 2**32 - 1  # an index is one word of a SeedSequence's spawn key


@dataclass(frozen=True)
class SplitEpisode:
    """Episode `index` of the split `split`, the same on every machine.

    All its randomness comes from a SeedSequence whose spawn key is the number of the split, then
    the index. Streams of other splits and indices have other spawn keys. The streams of an episode
    of `reset(seed=...)` have a spawn key of one number, hence none is a stream of a split (for
    seeds below 2**128).
    """

    split: str
    index: int

    def plain(self) -> dict[str, Any]:
        """Split and index by name, as the infos tell them."""
        return {"split": self.split, "index": self.index}

    def rng(self) -> np.random.Generator:
        """A new generator, at the beginning of the episode's stream."""
        key = SPLITS.index(self.split), self.index
        return np.random.Generator(
            np.random.PCG64(np.random.SeedSequence(SPLIT_ENTROPY, spawn_key=key))
        )
