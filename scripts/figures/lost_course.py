"""The probability of being lost over a run."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from slam.geometry import Array
from slam.metrics.lost import ALARM_LEVEL


class LostCourse(NamedTuple):
    """`Estimate.lost` at the scans of a run.

    times        (n,) stamps, s
    probability  (n,) of being lost
    """

    times: Array
    probability: Array

    @property
    def judged(self) -> bool:
        """Whether the SLAM judged it: one that does not leaves it at 0."""
        return bool((self.probability > 0.0).any())

    @property
    def lost(self) -> np.ndarray:
        """(n,) bool, whether the robot was lost."""
        return self.probability > ALARM_LEVEL


def stretches(marked: np.ndarray) -> list[tuple[int, int]]:
    """First index and the one after the last of each stretch of True in `marked`, (n,) bool."""
    changes = np.diff(np.concatenate([[False], marked, [False]]).astype(np.int8))
    begins, ends = np.flatnonzero(changes == 1), np.flatnonzero(changes == -1)
    return list(zip(begins.tolist(), ends.tolist(), strict=True))
