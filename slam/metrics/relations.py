"""Relations between poses of a real log, and the errors of a trajectory against them.

Source: Kuemmerle et al. (2009), "On measuring the accuracy of SLAM algorithms", equations 3 to 5.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from slam.errors import InputError
from slam.geometry import Array, between, compose, inverse, wrap_angle
from slam.metrics.json_scores import Number, json_scores
from slam.trajectory import Trajectory

STAMP_TOLERANCE = 2e-6  # s: stamps are written with six decimals
CLEAR = 2e-3  # s: where the clock of a recording stood still, a stamp fits several odometry lines


@dataclass(frozen=True)
class Relations:
    """True displacements between the robot's poses at pairs of times.

    first, second  (n,) s
    displacement   (n, 3) pose at `second` as seen from the pose at `first`: x, y in m, theta in rad
    """

    first: Array
    second: Array
    displacement: Array

    def __post_init__(self) -> None:
        n = len(self.first)
        if self.second.shape != (n,) or self.displacement.shape != (n, 3):
            raise InputError(
                f"relations have times (n,), (n,) and displacements (n, 3), got "
                f"{self.first.shape}, {self.second.shape} and {self.displacement.shape}"
            )

    def __len__(self) -> int:
        return len(self.first)


class RelationScores(NamedTuple):
    """Mean and standard deviation of the relations' errors; NaN if none could be scored.

    translation_mean, translation_std    m, of |trans(d_ij (-) d*_ij)|
    rotation_mean_deg, rotation_std_deg  degrees, of |rot(d_ij (-) d*_ij)|
    relations                            number of relations scored
    left_out                             number not scored: a stamp lies outside the log
    clear                                number of those scored whose stamps both fit one line of
                                         the odometry, none else within CLEAR
    clear_translation_mean               m, of these
    """

    translation_mean: float
    translation_std: float
    rotation_mean_deg: float
    rotation_std_deg: float
    relations: int
    left_out: int
    clear: int
    clear_translation_mean: float

    def as_dict(self, suffix: str = "") -> dict[str, Number | None]:
        """Flat, for JSON; an undefined score is None."""
        return json_scores(self._asdict(), suffix)


def score_relations(
    relations: Relations, corrected: Trajectory, odometry: Trajectory
) -> RelationScores:
    """Score the `corrected` poses (at scans), interpolated along the `odometry` (full stream)."""
    inside = within(odometry, relations.first) & within(odometry, relations.second)
    left_out = int((~inside).sum())
    if not inside.any():
        return RelationScores(math.nan, math.nan, math.nan, math.nan, 0, left_out, 0, math.nan)
    found = between(
        carried(corrected, odometry, relations.first[inside]),
        carried(corrected, odometry, relations.second[inside]),
    )
    error = between(relations.displacement[inside], found)
    translation = np.hypot(error[:, 0], error[:, 1])
    rotation = np.degrees(np.abs(error[:, 2]))
    clear = (clear_at(odometry, relations.first) & clear_at(odometry, relations.second))[inside]
    return RelationScores(
        translation_mean=float(translation.mean()),
        translation_std=float(translation.std()),
        rotation_mean_deg=float(rotation.mean()),
        rotation_std_deg=float(rotation.std()),
        relations=len(found),
        left_out=left_out,
        clear=int(clear.sum()),
        clear_translation_mean=float(translation[clear].mean()) if clear.any() else math.nan,
    )


def clear_at(odometry: Trajectory, times: Array) -> np.ndarray:
    """(n,) bool: at most one line of the odometry lies within CLEAR of each time."""
    last = np.searchsorted(odometry.times, times + CLEAR, side="right")
    return last - np.searchsorted(odometry.times, times - CLEAR) <= 1


def within(odometry: Trajectory, times: Array) -> np.ndarray:
    """(n,) bool: the times lie within the log."""
    low, high = odometry.times[0] - STAMP_TOLERANCE, odometry.times[-1] + STAMP_TOLERANCE
    return (times >= low) & (times <= high)


def carried(corrected: Trajectory, odometry: Trajectory, times: Array) -> Array:
    """Corrected poses (n, 3) at any `times`.

    Each is the corrected pose of the scan before it moved on by the odometry, blended (by time)
    with the pose of the scan after it moved back by the odometry. At a scan it is that scan's pose;
    before the first and after the last scan there is only one neighbour.
    """
    after = np.searchsorted(corrected.times, times).clip(0, len(corrected) - 1)
    before = (after - (corrected.times[after] > times)).clip(0)
    here, at_scans = odometry.at(times), odometry.at(corrected.times)
    correction = compose(corrected.poses, inverse(at_scans))
    forward, backward = compose(correction[before], here), compose(correction[after], here)
    gap = corrected.times[after] - corrected.times[before]
    weight = np.where(gap > 0, (times - corrected.times[before]) / np.where(gap > 0, gap, 1.0), 0.0)
    weight = weight.clip(0.0, 1.0)
    blended = forward + weight[:, None] * (backward - forward)
    blended[:, 2] = forward[:, 2] + weight * wrap_angle(backward[:, 2] - forward[:, 2])
    return blended
