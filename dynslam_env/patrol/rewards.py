"""Pay: what patrolling is rewarded for, by name."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from slam.geometry import Array
from slam.validation import instance, number, one_of

SURE = np.diag([0.005, 0.005, math.radians(0.2)]) ** 2
"""No pose is worth more than this covariance (m, m, rad): what is better is not needed."""


class RewardTerms(NamedTuple):
    """What one step brought, each in its own unit; the terms of the reward.

    information  bits by which scans made the dynamic map surer: what was never seen, and what was
                 not looked at for long where things change
    freshness    cells s: how much was seen lately, most of all of what changes, times how long
                 (`Memory.freshness`)
    pose         bits by which the pose became surer, 1/2 log2 of the ratio of the covariances'
                 determinants; negative where it became less sure. Its sum is bounded: no way
                 of driving to and fro is paid again and again
    distance     m that the wheels report
    collision    share of the step in which the bumper was touched
    """

    information: float = 0.0
    freshness: float = 0.0
    pose: float = 0.0
    distance: float = 0.0
    collision: float = 0.0


@dataclass(frozen=True)
class RewardWeights:
    """A weighted sum of named terms.

    weights  name -> weight, of the fields of `RewardTerms`. What is not named does not count
    """

    weights: Mapping[str, float] = field(
        hash=False,
        default_factory=lambda: {
            "information": 0.002, "freshness": 0.01, "pose": 0.05, "distance": -0.02,
            "collision": -1.0,
        },
    )  # fmt: skip

    def __post_init__(self) -> None:
        instance("Pay.weights", self.weights, Mapping)
        object.__setattr__(self, "weights", dict(self.weights))  # nobody else's to change
        for name, weight in self.weights.items():
            one_of("a name in Pay.weights", name, RewardTerms._fields)
            number(f"Pay.weights[{name!r}]", weight)

    def terms(self, gains: RewardTerms) -> dict[str, float]:
        """The weighted terms; the reward is their sum."""
        return {name: w * getattr(gains, name) for name, w in self.weights.items()}


def pose_bits(covariance: Array) -> float:
    """log2 of the size of where the robot may be; differences of it are information."""
    return 0.5 * float(np.linalg.slogdet(covariance + SURE)[1]) / math.log(2)
