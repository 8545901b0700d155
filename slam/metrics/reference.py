"""Scores of a trajectory against a reference with other stamps and in another frame.

As evo and the TUM RGB-D tools: Sturm et al. (2012); alignment of Umeyama (1991).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from slam.errors import InputError
from slam.geometry import Array, compose
from slam.metrics.json_scores import Number, json_scores
from slam.metrics.trajectory import RPE_DISTANCE, alignment, ate, heading_errors, rpe
from slam.trajectory import Trajectory

MAX_STAMP_GAP = 0.1  # s: a reference stamp farther from every estimate is left out


class ReferenceScores(NamedTuple):
    """Errors of the estimate, interpolated at the reference's stamps.

    ate_aligned      m, RMSE of the position after the best SE(2) alignment
    heading_rms      rad, after that alignment
    rpe_translation  m, RMSE over `RPE_DISTANCE` of the reference's path; NaN on a shorter path
    rpe_rotation     rad, likewise
    stamps           number of stamps compared
    """

    ate_aligned: float
    heading_rms: float
    rpe_translation: float
    rpe_rotation: float
    stamps: int

    def as_dict(self, suffix: str = "") -> dict[str, Number | None]:
        """Flat, for JSON; an undefined score is None."""
        return json_scores(self._asdict(), suffix)


def score_reference(reference: Trajectory, estimate: Trajectory) -> ReferenceScores:
    """All scores. Raises InputError if no stamp of the reference is within 0.1 s of one of the
    estimate."""
    truth, found = associated(reference, estimate)
    aligned = compose(np.array(alignment(found, truth)), found)
    translation, rotation = rpe(found, truth, RPE_DISTANCE)
    return ReferenceScores(
        ate_aligned=ate(aligned, truth),
        heading_rms=float(np.sqrt((heading_errors(aligned, truth) ** 2).mean())),
        rpe_translation=translation,
        rpe_rotation=rotation,
        stamps=len(truth),
    )


def associated(
    reference: Trajectory, estimate: Trajectory, apart: float = MAX_STAMP_GAP
) -> tuple[Array, Array]:
    """(n, 3) twice: the reference's poses at its stamps, the estimate's poses interpolated there.

    apart  s, maximum distance of a stamp from the nearest estimate; a stamp between two estimates
           that are both within 0.1 s is used in any case
    """
    times = reference.times
    after = np.searchsorted(estimate.times, times).clip(0, len(estimate) - 1)
    before = (after - 1).clip(0)
    ahead, behind = estimate.times[after] - times, times - estimate.times[before]
    between = (ahead >= 0) & (behind >= 0) & (np.maximum(ahead, behind) <= MAX_STAMP_GAP)
    shared = between | (np.minimum(abs(ahead), abs(behind)) <= apart)
    if not shared.any():
        raise InputError(
            f"no stamp of the reference ({times[0]:.3f} to {times[-1]:.3f} s) is within {apart} s "
            f"of one of the estimate ({estimate.times[0]:.3f} to {estimate.times[-1]:.3f} s)"
        )
    return reference.poses[shared], estimate.at(times[shared])
