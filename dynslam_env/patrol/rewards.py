"""The reward of a patrol: terms and weights, by name."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import NamedTuple

import numpy as np

from slam.geometry import Array
from slam.validation import instance, number, one_of

COVARIANCE_FLOOR = np.diag([0.005, 0.005, math.radians(0.2)]) ** 2
"""Covariance (m, m, rad) that is added to the pose's: below it, a better pose brings no reward."""


class RewardTerms(NamedTuple):
    """The unweighted reward terms of one step.

    information  bits, decrease by the scans of the entropy of the dynamic map: of cells never
                 observed, and of changing cells not observed for long
    freshness    cells s: `DynamicMap.freshness` times the duration of the step
    pose         bits, decrease of the pose's entropy: 1/2 log2 of the ratio of the
                 covariances' determinants, negative if it increased. Its sum is bounded,
                 so that driving back and forth is not rewarded repeatedly
    distance     m, by the wheels' odometry
    collision    share of the step in which the robot touched something
    """

    information: float = 0.0
    freshness: float = 0.0
    pose: float = 0.0
    distance: float = 0.0
    collision: float = 0.0


@dataclass(frozen=True)
class RewardWeights:
    """A weighted sum of named terms.

    weights  name -> weight, of the fields of `RewardTerms`; a missing name counts as 0
    """

    weights: Mapping[str, float] = field(
        hash=False,
        default_factory=lambda: {
            "information": 0.002, "freshness": 0.01, "pose": 0.05, "distance": -0.02,
            "collision": -1.0,
        },
    )  # fmt: skip

    def __post_init__(self) -> None:
        instance("RewardWeights.weights", self.weights, Mapping)
        object.__setattr__(self, "weights", dict(self.weights))  # a private copy
        for name, weight in self.weights.items():
            one_of("a name in RewardWeights.weights", name, RewardTerms._fields)
            number(f"RewardWeights.weights[{name!r}]", weight)

    def terms(self, gains: RewardTerms) -> dict[str, float]:
        """The weighted terms; the reward is their sum."""
        return {name: w * getattr(gains, name) for name, w in self.weights.items()}


def pose_bits(covariance: Array) -> float:
    """1/2 log2 det of the covariance, with COVARIANCE_FLOOR added; differences are bits."""
    if not covariance.any():
        return _known_pose_bits()
    return _bits(covariance)


@cache
def _known_pose_bits() -> float:
    """Of a pose that is known exactly, as at the start of an episode."""
    return _bits(np.zeros((3, 3)))


def _bits(covariance: Array) -> float:
    return 0.5 * float(np.linalg.slogdet(covariance + COVARIANCE_FLOOR)[1]) / math.log(2)
