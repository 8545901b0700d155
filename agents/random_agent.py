"""RandomAgent: uniformly random actions, the baseline of all agents."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np


class RandomAgent:
    """Draws actions uniformly from an action space, whose generator it seeds."""

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
        """A random action; `state` is returned unchanged."""
        return self._space.sample(), state
