"""A part of a recording: the scans between two times, and the odometry around them."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from slam.episode import Episode, Truth
from slam.errors import InputError
from slam.trajectory import Trajectory

FIRST_STAMP = 1e8  # s: a number from here on (March 1973 in unix time) is a stamp
SPARE = 1.0  # s of odometry kept before and after the scans: clocks may be corrected by less


def moment(number: float, start: float) -> float:
    """The stamp, s, that a user's number means: seconds from `start` (s), or a stamp itself."""
    return number if number >= FIRST_STAMP else start + number


def between_times(episode: Episode, begin: float | None, end: float | None) -> Episode:
    """The scans of an episode from stamp `begin` to stamp `end` (s, both included, None: no limit),
    with their odometry and truth. Raises InputError where no scan lies between."""
    times = episode.times
    low = -math.inf if begin is None else begin
    high = math.inf if end is None else end
    kept = np.flatnonzero((times >= low) & (times <= high))
    if not len(kept):
        raise InputError(
            f"no scan lies between {low - times[0]:.2f} and {high - times[0]:.2f} s: there are "
            f"{len(times)} from 0 to {times[-1] - times[0]:.2f} s after the first "
            f"(stamps {times[0]:.2f} to {times[-1]:.2f})"
        )
    if len(kept) == len(times):
        return episode
    scans = tuple(episode.scans[k] for k in kept.tolist())
    odometry = _around(episode.odometry, scans[0].time, scans[-1].time)
    truth = None if episode.truth is None else _of_scans(episode.truth, kept)
    return dataclasses.replace(episode, scans=scans, odometry=odometry, truth=truth)


def _around(odometry: Trajectory, first: float, last: float) -> Trajectory:
    """The poses from SPARE before `first` to SPARE after `last` (s), and one more at each end."""
    begin = max(int(np.searchsorted(odometry.times, first - SPARE)) - 1, 0)
    end = int(np.searchsorted(odometry.times, last + SPARE, side="right")) + 1
    begin = min(begin, len(odometry) - 1)
    return Trajectory(odometry.times[begin:end], odometry.poses[begin:end])


def _of_scans(truth: Truth, kept: np.ndarray) -> Truth:
    return Truth(truth.poses[kept], truth.walls, truth.doors[kept])
