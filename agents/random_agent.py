"""RandomAgent: uniformly random actions; the floor for every other agent."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np


class RandomAgent:
    """Draws from an action space with a generator of its own."""

    def __init__(self, action_space: gym.Space[Any], seed: int | None = None):
        self._space = action_space
        self._space.seed(seed)

    def predict(
        self,
        observation: Any = None,
        state: Any = None,
        episode_start: Any = None,
        deterministic: bool = False,
    ) -> tuple[np.ndarray, Any]:
        """Any action; `state` is handed through."""
        return self._space.sample(), state
