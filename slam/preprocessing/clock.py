"""The clocks of a recording: by how much the odometry's stamps are late against the laser's.

One number can be identified, from the turning of laser and odometry (`turning`): the stamp of the
odometry that is of the same moment as the middle of a sweep. Whether a stamp is of the sweep's
beginning or of its end cannot be told from an offset of one sweep, nor does the sharpness of the
corrected scans tell it: the motion during a sweep corrects a scan, and one sweep later it is nearly
the same. So of the two, that is chosen which leaves the smaller offset between the clocks, and
the beginning, as ROS has it, unless the middle is before the stamp by `SURE` standard errors.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from slam.episode import Episode
from slam.geometry import Array, Pose2
from slam.preprocessing.deskewing import MAX_SWEEP
from slam.preprocessing.scan_rotation import contour, rotation
from slam.preprocessing.turning import MAX_OFFSET, TurningProfile
from slam.scan import Scan
from slam.trajectory import Trajectory

SCAN_GAP = (0.08, 0.5)  # s from a scan to the next one that it is matched with
MAX_PAIRS = 1500  # of scans that are matched: those where the turning changes most
MIN_PAIRS = 30
MIN_CHANGE = 0.25  # of the turning within `MAX_OFFSET`, as a share of nearly the largest
LARGEST_CHANGE = 0.98  # quantile of the changes that is nearly the largest
CHANGE_SAMPLES = 13  # offsets within `MAX_OFFSET` at which the turning is compared
MIN_EXPLAINED = 0.5  # share of the laser's turning that the odometry explains
MAX_DEVIATION = 0.03  # s; a less sure estimate is none
SURE = 3.0  # standard errors
MIN_OFFSET = 0.02  # s; a smaller offset is not worth a correction


class Clock(NamedTuple):
    """How stamps are corrected.

    offset  s by which the odometry's stamps are late against the laser's
    end     whether a scan's stamp is of the end of its sweep, rather than of its beginning
    """

    offset: float = 0.0
    end: bool = False


class ClockEstimate(NamedTuple):
    """What a recording tells about its clocks.

    middle     s, the odometry's stamp less the laser's, at the middle of a sweep; NaN: not known
    deviation  s, its standard error; NaN: not known
    sweep      s, the median duration of a sweep; 0 where the recording does not state it
    reason     why it could not be told; empty where it could
    """

    middle: float
    deviation: float
    sweep: float
    reason: str = ""

    @property
    def end(self) -> bool:
        """Whether stamps are taken to be of the end of a sweep."""
        return self.sweep > 0 and self.middle < -SURE * self.deviation

    @property
    def offset(self) -> float:
        """s by which the odometry's stamps are late; NaN: not known."""
        return self.middle + (0.5 if self.end else -0.5) * self.sweep

    @property
    def significant(self) -> bool:
        """Whether the offset is surely not zero, and worth a correction."""
        return abs(self.offset) > max(SURE * self.deviation, MIN_OFFSET)

    @property
    def clock(self) -> Clock:
        """The correction that is used: none of what is not significant."""
        return Clock(self.offset if self.significant else 0.0, self.end)


def synchronised(episode: Episode) -> Episode:
    """The episode with the correction that its estimate tells to use."""
    return with_clock(episode, estimated_clock(episode).clock)


def with_clock(episode: Episode, clock: Clock) -> Episode:
    """The episode with the odometry's stamps moved to the laser's clock, and each scan's stamp at
    the beginning of its sweep; its `meta["clock"]` tells the correction.

    Where the moved odometry does not reach the first or the last scan, the robot is taken to
    have moved there as it did next to it.
    """
    if clock == Clock():
        return episode
    told = {"offset_s": clock.offset, "stamp": "end" if clock.end else "begin"}
    scans, odometry = episode.scans, episode.odometry
    if clock.end:
        scans = tuple(dataclasses.replace(scan, time=scan.time - _sweep(scan)) for scan in scans)
    if clock.offset and episode.has_odometry:
        odometry = _earlier(odometry, clock.offset)
    return dataclasses.replace(
        episode, scans=scans, odometry=odometry, meta={**episode.meta, "clock": told}
    )


def estimated_clock(episode: Episode) -> ClockEstimate:
    """The estimate for a recording."""
    sweep = float(np.median([_sweep(scan) for scan in episode.scans]))
    try:
        middle, deviation = _estimated(episode)
    except _NotTold as why:
        return ClockEstimate(math.nan, math.nan, sweep, str(why))
    return ClockEstimate(middle, deviation, sweep)


class _NotTold(Exception):  # noqa: N818 (an answer, not an error)
    """The recording does not tell the offset; the text says why."""


def _estimated(episode: Episode) -> tuple[float, float]:
    """`ClockEstimate.middle` and `deviation`. Raises _NotTold."""
    profile = _profile(episode)
    middle = profile.best()
    if not math.isfinite(middle):
        raise _NotTold(f"no offset up to {MAX_OFFSET:g} s fits best")
    fit = profile.fit(middle)
    if not profile.explained(fit) > MIN_EXPLAINED:
        raise _NotTold("laser and odometry turn too little, or not alike")
    deviation = profile.deviation(middle, fit)
    if not deviation < MAX_DEVIATION:
        raise _NotTold("the robot turns too little")
    return middle, deviation


def _profile(episode: Episode) -> TurningProfile:
    if not episode.has_odometry:
        raise _NotTold("there is no odometry")
    pairs = turning_pairs(episode)
    if len(pairs) < MIN_PAIRS:
        raise _NotTold(f"fewer than {MIN_PAIRS} scans follow each other within {SCAN_GAP[1]:g} s")
    turned = turned_by_laser(episode.scans, pairs)
    matched = np.isfinite(turned)
    if matched.sum() < MIN_PAIRS:
        raise _NotTold("the scans could not be matched")
    return TurningProfile(episode.odometry, episode.times[pairs[matched]], turned[matched])


def turning_pairs(episode: Episode) -> np.ndarray:
    """(n, 2) indices of the pairs of scans, one soon after the other, around which the odometry's
    turning rate changes most; `MAX_PAIRS` at most."""
    return _informative(episode, _pairs(episode.times))


def _pairs(times: Array) -> np.ndarray:
    """(n, 2) indices of scans that follow each other within `SCAN_GAP`."""
    found, i = [], 0
    while i < len(times) - 1:
        j = max(int(np.searchsorted(times, times[i] + SCAN_GAP[0])), i + 1)
        if j < len(times) and times[j] - times[i] <= SCAN_GAP[1]:
            found.append((i, j))
        i = j
    return np.array(found, dtype=np.intp).reshape(-1, 2)


def _informative(episode: Episode, pairs: np.ndarray) -> np.ndarray:
    """Those of the pairs, `MAX_PAIRS` at most, around which the odometry's turning rate changes
    most; without this choice, the many pairs of a straight drive would determine the loss."""
    if not len(pairs):
        return pairs
    heading = np.unwrap(episode.odometry.poses[:, 2])
    around = np.linspace(-MAX_OFFSET, MAX_OFFSET, CHANGE_SAMPLES)
    stamps = episode.times[pairs][:, :, None] + around
    turned = np.diff(np.interp(stamps, episode.odometry.times, heading), axis=1)[:, 0]
    change = np.ptp(turned, axis=1)
    enough = change >= MIN_CHANGE * np.quantile(change, LARGEST_CHANGE)
    order = np.argsort(-change, kind="stable")[: min(MAX_PAIRS, int(enough.sum()))]
    return pairs[np.sort(order)]


def turned_by_laser(scans: Sequence[Scan], pairs: np.ndarray) -> Array:
    """(n,) rad by which the laser turned between the scans of each pair (n, 2); NaN where two do
    not match."""
    at = lru_cache(maxsize=2)(lambda k: contour(scans[k]))
    return np.array([rotation(at(i), at(j)) for i, j in pairs.tolist()])


def _sweep(scan: Scan) -> float:
    """s, duration of a sweep; 0 where it is not stated or wrong."""
    seconds = scan.beam_time * len(scan.ranges)
    return seconds if 0 < seconds <= MAX_SWEEP else 0.0


def _earlier(odometry: Trajectory, seconds: float) -> Trajectory:
    """Its stamps earlier by `seconds`, and at the end that this moved inwards one more pose, as
    if the robot had moved there as it did next to it."""
    times, poses = odometry.times - seconds, odometry.poses
    at, side = (len(times), -1) if seconds > 0 else (0, 0)
    near = odometry.at(np.array([odometry.times[side], odometry.times[side] - seconds]))
    last, before = (Pose2.of(row) for row in near)
    beyond = last @ before.between(last)
    return Trajectory(
        np.insert(times, at, odometry.times[side]), np.insert(poses, at, beyond, axis=0)
    )
