"""Poses at every scan from the keyframes of another SLAM system: one rule for all systems."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from slam.episode import Episode
from slam.errors import InputError
from slam.geometry import Array, between, compose, inverse, wrap_angle
from slam.metrics.external import STAMP_TOLERANCE
from slam.trajectory import Trajectory

MIN_MATCHED = 0.5  # share of the keyframes that must have the stamp of a scan


class Filled(NamedTuple):
    """A pose at every scan.

    poses      (n, 3), in the frame of the keyframes
    keyframes  (k,) numbers of the scans that had a pose of their own
    """

    poses: Array
    keyframes: np.ndarray


def filled(episode: Episode, given: Trajectory) -> Filled:
    """A pose at every scan of `episode` from the poses that were `given` at some of them.

    A keyframe belongs to the nearest scan, and is dropped if its stamp is more than
    STAMP_TOLERANCE from it. A scan between two keyframes has the mean of two poses: the odometry
    counted on from the keyframe before, and back from the one after, weighted by the time to them.
    Before the first and after the last keyframe, the odometry is counted from it.

    Raises InputError if fewer than half of the keyframes have the stamp of a scan.
    """
    scans, which = _matched(episode.times, given.times)
    odometry = episode.odometry.at(episode.times)
    offsets = compose(given.poses[which], inverse(odometry[scans]))  # world of the odometry's frame
    number = np.arange(len(episode.scans))
    after = np.searchsorted(scans, number).clip(0, len(scans) - 1)
    before = (np.searchsorted(scans, number, side="right") - 1).clip(0)
    onward = compose(offsets[before], odometry)
    back = compose(offsets[after], odometry)
    share = _share(episode.times, scans, before, after)[:, None]
    step = back - onward
    step[:, 2] = wrap_angle(step[:, 2])
    poses = onward + share * step
    poses[:, 2] = wrap_angle(poses[:, 2])
    return Filled(poses, scans)


def anchored(poses: Array, first: Array) -> Array:
    """The poses (n, 3) moved as one such that the first of them is `first` (3,)."""
    return compose(first, between(poses[0], poses))


def _matched(times: Array, stamps: Array) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of the scans that have a keyframe, increasing, and which keyframe: the nearest."""
    nearest = np.searchsorted((times[1:] + times[:-1]) / 2, stamps)
    apart = np.abs(times[nearest] - stamps)
    fit = apart <= STAMP_TOLERANCE
    if fit.mean() < MIN_MATCHED:
        raise InputError(
            f"{int(fit.sum())} of {len(stamps)} poses have the stamp of a scan within "
            f"{STAMP_TOLERANCE:g} s: the poses are from {stamps[0]:.3f} to {stamps[-1]:.3f} s, the "
            f"scans from {times[0]:.3f} to {times[-1]:.3f} s"
        )
    order = np.lexsort((apart[fit], nearest[fit]))
    scans, first = np.unique(nearest[fit][order], return_index=True)
    return scans, np.flatnonzero(fit)[order][first]


def _share(times: Array, scans: np.ndarray, before: np.ndarray, after: np.ndarray) -> Array:
    """(n,) weight of the keyframe after each scan: 0 at the one before, 1 at the one after."""
    start, end = times[scans[before]], times[scans[after]]
    span = np.maximum(end - start, np.finfo(float).tiny)
    return np.where(end > start, (times - start) / span, 0.0)
