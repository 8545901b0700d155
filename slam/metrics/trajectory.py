"""Trajectory scores: ATE, heading, end pose, RPE. Poses (n, 3) of estimate and truth, same scans.

ATE and RPE as in Sturm et al. (2012), "A benchmark for the evaluation of RGB-D SLAM systems";
alignment as in Umeyama (1991), in the plane and without scale.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from slam.errors import InputError
from slam.geometry import Array, Pose2, between, compose, inverse, wrap_angle
from slam.metrics.json_scores import Number, json_scores

FAILURE_ATE = 0.3  # m: with a larger ATE the robot counts as lost
RPE_DISTANCE = 1.0  # m of true path


class TrajectoryScores(NamedTuple):
    """Errors of an estimate against the truth, both in the world frame and not aligned.

    ate              m, RMSE of the position
    ate_anchored     m, the same with the first pose moved onto the true one
    ate_aligned      m, the same after the best SE(2) alignment
    heading_max      rad, largest heading error
    heading_rms      rad
    end_position     m, error of the last pose
    end_heading      rad, error of the last pose
    rpe_translation  m, RMSE over `RPE_DISTANCE` of true path; NaN on a shorter path
    rpe_rotation     rad, likewise
    failed           ATE above `FAILURE_ATE`
    """

    ate: float
    ate_anchored: float
    ate_aligned: float
    heading_max: float
    heading_rms: float
    end_position: float
    end_heading: float
    rpe_translation: float
    rpe_rotation: float
    failed: bool

    def as_dict(self, suffix: str = "") -> dict[str, Number | None]:
        """Flat, for JSON; an undefined score is None."""
        return json_scores(self._asdict(), suffix)


def score_trajectory(estimate: Array, truth: Array) -> TrajectoryScores:
    """All scores, without alignment; apply `anchored` first if the frames differ."""
    _check(estimate, truth)
    heading = np.abs(heading_errors(estimate, truth))
    error = ate(estimate, truth)
    rpe_translation, rpe_rotation = rpe(estimate, truth, RPE_DISTANCE)
    return TrajectoryScores(
        ate=error,
        ate_anchored=ate(anchored(estimate, truth), truth),
        ate_aligned=ate(compose(alignment(estimate, truth), estimate), truth),
        heading_max=float(heading.max()),
        heading_rms=_rms(heading),
        end_position=float(np.hypot(*(estimate[-1, :2] - truth[-1, :2]))),
        end_heading=float(heading[-1]),
        rpe_translation=rpe_translation,
        rpe_rotation=rpe_rotation,
        failed=error > FAILURE_ATE,
    )


def anchored(estimate: Array, truth: Array) -> Array:
    """The estimate moved rigidly, so that its first pose is the truth's first."""
    _check(estimate, truth)
    return compose(compose(truth[0], inverse(estimate[0])), estimate)


def alignment(estimate: Array, truth: Array) -> Pose2:
    """The rigid motion that brings the estimate's positions closest to the truth's.

    Umeyama (1991) without scale, in closed form in the plane. If the robot never moved, the
    rotation is undefined and set to zero.
    """
    _check(estimate, truth)
    mean_e, mean_t = estimate[:, :2].mean(axis=0), truth[:, :2].mean(axis=0)
    e, t = estimate[:, :2] - mean_e, truth[:, :2] - mean_t
    theta = math.atan2(
        float((e[:, 0] * t[:, 1] - e[:, 1] * t[:, 0]).sum()),
        float((e * t).sum()),
    )
    turned = Pose2(0.0, 0.0, theta) @ Pose2(float(mean_e[0]), float(mean_e[1]))
    return Pose2(float(mean_t[0]) - turned.x, float(mean_t[1]) - turned.y, theta)


def ate(estimate: Array, truth: Array) -> float:
    """Absolute trajectory error: RMSE of the position, m."""
    _check(estimate, truth)
    return _rms(np.hypot(*(estimate[:, :2] - truth[:, :2]).T))


def heading_errors(estimate: Array, truth: Array) -> Array:
    """(n,) rad, estimate minus truth, wrapped."""
    return wrap_angle(estimate[:, 2] - truth[:, 2])


def rpe(estimate: Array, truth: Array, distance: float) -> tuple[float, float]:
    """Relative pose error over `distance` m of true path: RMSE of translation, m, and heading, rad.

    From every pose to the first pose at least that far along. NaN if the path is shorter.
    """
    _check(estimate, truth)
    path = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(truth[:, :2], axis=0).T))])
    ends = np.searchsorted(path, path + distance - 1e-9)
    starts = np.flatnonzero(ends < len(path))
    if not len(starts):
        return math.nan, math.nan
    ends = ends[starts]
    true_motion = between(truth[starts], truth[ends])
    error = between(true_motion, between(estimate[starts], estimate[ends]))
    return _rms(np.hypot(error[:, 0], error[:, 1])), _rms(error[:, 2])


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def _check(estimate: Array, truth: Array) -> None:
    if estimate.shape != truth.shape or estimate.ndim != 2 or estimate.shape[1:] != (3,):
        raise InputError(
            f"estimate and truth are poses (n, 3) at the same scans, "
            f"got {estimate.shape} and {truth.shape}"
        )
    if not len(truth):
        raise InputError("a trajectory score needs at least one pose, got none")
