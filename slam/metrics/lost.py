"""Scores of `Estimate.lost`: does a SLAM know when its pose is wrong, and how soon?

A pose is wrong where it is off by more than LOST_DISTANCE or LOST_TURN within the map. A SLAM tells
that it is lost where `lost` is above ALARM_LEVEL. Times are those of the scans; nothing is known in
between.

Area under the ROC curve: Hanley and McNeil (1982). Expected calibration error: Naeini, Cooper and
Hauskrecht (2015), in ten equal bins. Score of the probabilities: Brier (1950).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from slam.errors import InputError
from slam.geometry import Array, wrap_angle
from slam.metrics.within_map import LOST_DISTANCE as LOST_DISTANCE
from slam.metrics.within_map import LOST_TURN as LOST_TURN
from slam.metrics.within_map import wrong_within_map

ALARM_LEVEL = 0.5  # of `lost`; above it the SLAM tells that it is lost
DRAWN_LEVEL = 0.1  # of `lost`; above it a scan is not regarded as part of the map
SETTLED_TIME = 2.0  # s; two losses, or two alarms, with less between them are one
TOLD_IN_TIME = 5.0  # s, from the beginning of a loss
BINS = 10  # equal bins of the reliability diagram
RANK_BINS = 120  # of the counts by which runs are pooled for the area under the ROC curve
MAX_LOGIT = 12.0  # of these bins, equal in log(p / (1 - p))
Bools = np.ndarray


class Loss(NamedTuple):
    """A time during which the pose was wrong.

    begin  s, of the first scan with a wrong pose
    end    s, of the first scan from which on the pose was right; None: never in the recording
    told   s, of the first scan during the loss at which the SLAM told; None: it did not
    until  s, of the last scan of the recording; inf: not known (results before 27 November 2026)
    """

    begin: float
    end: float | None
    told: float | None
    until: float = math.inf


class Reliability(NamedTuple):
    """A reliability diagram: the scans by `lost`, in ten equal bins; lists of ten.

    scans  number of scans
    told   mean of `lost`; 0 in an empty bin
    wrong  share of the scans with a wrong pose; 0 in an empty bin
    """

    scans: list[int]
    told: list[float]
    wrong: list[float]


class RankCounts(NamedTuple):
    """The scans by `lost` in RANK_BINS bins, apart by whether their pose was right or wrong."""

    right: list[int]
    wrong: list[int]


class LostScores(NamedTuple):
    """How well one run told that it was lost.

    lost_share      of the scans, whose pose was wrong
    lost_at_end     whether the last pose was off by as much in the world
    sure_and_wrong  share of the scans with a wrong pose for which `lost` was at most ALARM_LEVEL
    brier           mean squared difference of `lost` and the truth
    auroc           area under the ROC curve; NaN where all poses are right, or all wrong
    false_alarms    alarms during which no pose was wrong
    hours_right     h, time during which the pose was right
    losses          in order of time
    reliability     of `lost`
    ranks           counts, to pool the area under the ROC curve over runs
    """

    lost_share: float
    lost_at_end: bool
    sure_and_wrong: float
    brier: float
    auroc: float
    false_alarms: int
    hours_right: float
    losses: list[Loss]
    reliability: Reliability
    ranks: RankCounts

    def as_dict(self) -> dict[str, object]:
        """Nested, for JSON; an undefined score is None."""
        return self._asdict() | {
            "auroc": None if math.isnan(self.auroc) else self.auroc,
            "losses": [loss._asdict() for loss in self.losses],
            "reliability": self.reliability._asdict(),
            "ranks": self.ranks._asdict(),
        }


def score_lost(
    times: Array, poses: Array, truth: Array, lost: Array, revisions: Sequence[Array] = ()
) -> LostScores:
    """All scores of one run.

    times         (n,) s, of the scans
    poses, truth  (n, 3) online estimates and true poses, in one frame
    lost          (n,) `Estimate.lost`
    revisions     (k, 3) arrays: poses of the first k scans, each time that the SLAM moved them at
                  the k-th

    Raises InputError for other shapes, for no scan, and for probabilities outside of 0 to 1.
    """
    check_probabilities(lost, len(times))
    off = is_wrong(poses, truth)
    if len(off) != len(times):
        raise InputError(f"there is one pose a scan, got {len(off)} for {len(times)} scans")
    alarm = lost > ALARM_LEVEL
    wrong = wrong_within_map(poses, truth, may_be_drawn(times, lost), revisions)
    return LostScores(
        lost_share=float(wrong.mean()),
        lost_at_end=bool(off[-1]),
        sure_and_wrong=float((wrong & ~alarm).mean()),
        brier=float(np.mean((lost - wrong) ** 2)),
        auroc=auroc(lost, wrong),
        false_alarms=false_alarms(times, wrong, alarm),
        hours_right=_time_right(times, wrong) / 3600.0,
        losses=losses(times, wrong, alarm),
        reliability=reliability(lost, wrong),
        ranks=rank_counts(lost, wrong),
    )


def may_be_drawn(times: Array, lost: Array) -> Bools:
    """(n,) whether each scan may be part of the map: `lost` is at most DRAWN_LEVEL, and no alarm
    follows within TOLD_IN_TIME, until which a SLAM may withhold what it saw."""
    alarms = np.append(times[lost > ALARM_LEVEL], math.inf)
    until_alarm = alarms[np.searchsorted(alarms, times)] - times
    return (lost <= DRAWN_LEVEL) & (until_alarm > TOLD_IN_TIME)


def is_wrong(poses: Array, truth: Array) -> Bools:
    """(n,) whether each of the poses (n, 3) is off by more than LOST_DISTANCE or LOST_TURN."""
    if poses.shape != truth.shape or poses.ndim != 2 or poses.shape[1] != 3:
        raise InputError(
            f"estimate and truth are poses (n, 3), got {poses.shape} and {truth.shape}"
        )
    off = np.hypot(*(poses - truth)[:, :2].T)
    return (off > LOST_DISTANCE) | (np.abs(wrap_angle(poses[:, 2] - truth[:, 2])) > LOST_TURN)


# -- when --------------------------------------------------------------------------------------


def losses(times: Array, wrong: Bools, alarm: Bools) -> list[Loss]:
    """The losses of a run; shorter right times than SETTLED_TIME between them do not count."""
    found = []
    for first, last in _spans(times, wrong):
        told = np.flatnonzero(alarm[first : last + 1])
        end = float(times[last + 1]) if last + 1 < len(times) else None
        when = float(times[first + told[0]]) if len(told) else None
        found.append(Loss(float(times[first]), end, when, float(times[-1])))
    return found


def false_alarms(times: Array, wrong: Bools, alarm: Bools) -> int:
    """Number of alarms during which no pose was wrong; alarms within SETTLED_TIME are one."""
    return sum(not wrong[first : last + 1].any() for first, last in _spans(times, alarm))


def _spans(times: Array, flags: Bools) -> list[tuple[int, int]]:
    """First and last scan of each stretch of true flags, joined across less than SETTLED_TIME."""
    spans: list[tuple[int, int]] = []
    for k in np.flatnonzero(flags).tolist():
        if spans and (k == spans[-1][1] + 1 or times[k] - times[spans[-1][1]] < SETTLED_TIME):
            spans[-1] = spans[-1][0], k
        else:
            spans.append((k, k))
    return spans


def _time_right(times: Array, wrong: Bools) -> float:
    """s, of the intervals that begin with a right pose."""
    return float(np.diff(times)[~wrong[:-1]].sum())


# -- how well calibrated, and how well told apart ----------------------------------------------


def reliability(lost: Array, wrong: Bools) -> Reliability:
    """The reliability diagram of probabilities (n,) of what was true or not (n,)."""
    bins = np.minimum((lost * BINS).astype(np.int64), BINS - 1)
    scans = np.bincount(bins, minlength=BINS)
    told, share = (
        np.bincount(bins, values, minlength=BINS) / np.maximum(scans, 1) for values in (lost, wrong)
    )
    return Reliability(scans.tolist(), told.tolist(), share.tolist())


def calibration_error(diagram: Reliability) -> float:
    """Expected calibration error: mean distance from the diagonal, weighted by the scans; NaN
    without a scan."""
    scans, told, wrong = (np.array(values, dtype=np.float64) for values in diagram)
    return float((scans * abs(told - wrong)).sum() / scans.sum()) if scans.sum() else math.nan


def auroc(lost: Array, wrong: Bools) -> float:
    """Area under the ROC curve: the probability that `lost` is larger for a scan with a wrong pose
    than for one with a right pose, equal ones counting half. NaN where either is missing."""
    _, level = np.unique(lost, return_inverse=True)
    right, bad = (np.bincount(level[flags], minlength=level.max() + 1) for flags in (~wrong, wrong))
    return auroc_of_counts(right, bad)


def rank_counts(lost: Array, wrong: Bools) -> RankCounts:
    """The counts of `auroc_of_counts`, in bins that are equal in log(p / (1 - p))."""
    edge = 1.0 / (1.0 + math.exp(MAX_LOGIT))
    inside = np.clip(lost, edge, 1.0 - edge)
    share = (np.log(inside / (1.0 - inside)) + MAX_LOGIT) / (2.0 * MAX_LOGIT)
    bins = np.minimum((share * RANK_BINS).astype(np.int64), RANK_BINS - 1)
    right, bad = (np.bincount(bins[flags], minlength=RANK_BINS) for flags in (~wrong, wrong))
    return RankCounts(right.tolist(), bad.tolist())


def auroc_of_counts(right: np.ndarray | Sequence[int], wrong: np.ndarray | Sequence[int]) -> float:
    """Area under the ROC curve from the numbers of right and of wrong poses at increasing levels of
    `lost`; NaN where either is missing."""
    right, wrong = (np.asarray(counts, dtype=np.float64) for counts in (right, wrong))
    pairs = right.sum() * wrong.sum()
    if not pairs:
        return math.nan
    below = np.cumsum(right) - right
    return float((wrong * (below + 0.5 * right)).sum() / pairs)


# -- over several runs -------------------------------------------------------------------------


def pooled(diagrams: Sequence[Reliability]) -> Reliability:
    """One diagram of all scans of several runs."""
    scans, told, wrong = np.array(diagrams, dtype=np.float64).reshape(-1, 3, BINS).swapaxes(0, 1)
    total = scans.sum(axis=0)
    means = ((scans * values).sum(axis=0) / np.maximum(total, 1) for values in (told, wrong))
    return Reliability(total.astype(np.int64).tolist(), *(mean.tolist() for mean in means))


def told_in_time(loss: Loss) -> bool:
    """Whether the SLAM told a loss, or corrected it, within TOLD_IN_TIME."""
    return any(
        when is not None and when - loss.begin <= TOLD_IN_TIME for when in (loss.told, loss.end)
    )


def had_time(loss: Loss) -> bool:
    """Whether a loss began so long before the end that it could be told in time."""
    return loss.until - loss.begin >= TOLD_IN_TIME


def check_probabilities(lost: Array, count: int) -> None:
    """Check that `lost` holds `count` >= 1 probabilities; raises InputError."""
    if lost.shape != (count,) or not count:
        raise InputError(f"there is one `lost` a scan, and at least one scan, got {lost.shape}")
    if not ((lost >= 0.0) & (lost <= 1.0)).all():
        raise InputError("`Estimate.lost` must be a probability from 0 to 1")
