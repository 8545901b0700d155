"""Whether a laser turns with the robot: upright, upside down, or not at all.

The rotation of the laser from scan to scan, found without odometry (`scan_rotation`), is compared
with that of the odometry. A laser that is mounted upside down, though its recording does not say
so, sees the world mirrored: it seems to turn against the robot. One that does not turn while the
robot does, and sees the same before and after, is not on the robot, or repeats an old scan.
"""

from __future__ import annotations

import dataclasses
import math
from enum import Enum
from itertools import pairwise

import numpy as np

from slam.episode import Episode
from slam.geometry import Array
from slam.preprocessing.clock import turned_by_laser, turning_pairs
from slam.scan import Scan

MIN_TURN = math.radians(1.5)  # rad by the odometry between two scans, of pairs that are compared
MIN_PAIRS = 20  # of them; fewer tell nothing
MAX_PAIRS = 120  # of them that are compared
MIRRORED_RATIO = (-1.5, -0.5)  # of the laser's turning to the odometry's, median of the pairs
STILL_RATIO = 0.1  # the same, at most, of a laser that does not turn
MIN_AGREEING = 0.8  # share of the pairs whose ratios must be of the same sense
APART_TURN = math.radians(30.0)  # rad by the odometry between two scans that should differ
COMPARED = 60  # pairs of such scans
SAME_RANGE, SAME_BEAMS = 0.05, 0.9  # m, and share of the beams within it, of scans that do not
MIN_REPEATED = 0.9  # share of the scans that repeat the one before, of a laser that is stuck
MIN_WAY = 0.5  # m by the odometry over which a laser is watched for repeats


class Sense(Enum):
    """How a laser turns while the robot turns."""

    UPRIGHT = "it turns with the robot, or the recording does not tell"
    MIRRORED = "it turns against the robot: it is upside down"
    STILL = "it does not turn with the robot"


def sense_of(episode: Episode) -> Sense:
    """How the laser of an episode turns; UPRIGHT where too few scans turn, or do not match."""
    if not episode.has_odometry:
        return Sense.UPRIGHT
    if _stuck(episode):
        return Sense.STILL
    by_odometry, by_laser = _turns(episode)
    if len(by_laser) < MIN_PAIRS:
        return Sense.UPRIGHT
    ratio = by_laser / by_odometry
    low, high = MIRRORED_RATIO
    if low <= np.median(ratio) <= high and (ratio < 0).mean() >= MIN_AGREEING:
        return Sense.MIRRORED
    if (np.abs(ratio) <= STILL_RATIO).mean() >= MIN_AGREEING and _unchanged(episode):
        return Sense.STILL
    return Sense.UPRIGHT


def turned_over(episode: Episode) -> Episode:
    """The episode with the angles of all scans the other way round."""
    scans = tuple(dataclasses.replace(scan, angles=-scan.angles) for scan in episode.scans)
    return dataclasses.replace(episode, scans=scans)


def _stuck(episode: Episode) -> bool:
    """Whether nearly all scans repeat the one before, to the bit, while the robot drives."""
    scans, poses = episode.scans, episode.odometry.poses
    if len(scans) < MIN_PAIRS:
        return False
    repeated = [
        np.array_equal(one.ranges, two.ranges, equal_nan=True) for one, two in pairwise(scans)
    ]
    steps = np.diff(poses[:, :2], axis=0)
    way = float(np.hypot(steps[:, 0], steps[:, 1]).sum())
    return way >= MIN_WAY and float(np.mean(repeated)) >= MIN_REPEATED


def _unchanged(episode: Episode) -> bool:
    """Whether scans look the same after the robot turned far, by the odometry: if the odometry is
    wrong instead, they do not, since the robot drove on."""
    heading = np.unwrap(episode.odometry.at(episode.times)[:, 2])
    chosen = np.unique(np.linspace(0, len(heading) - 1, COMPARED).astype(int)).tolist()
    pairs = [(i, j) for i in chosen for j in chosen if heading[j] - heading[i] >= APART_TURN]
    picked = pairs[:: max(len(pairs) // COMPARED, 1)]
    shares = [_same_share(episode.scans[i], episode.scans[j]) for i, j in picked]
    return bool(shares) and float(np.median(shares)) >= SAME_BEAMS


def _same_share(one: Scan, two: Scan) -> float:
    """Share of the beams with an echo in both scans that measured the same."""
    if len(one.ranges) != len(two.ranges):
        return 0.0
    both = one.hit & two.hit
    off = np.abs(one.ranges[both] - two.ranges[both])
    return float((off <= SAME_RANGE).mean()) if len(off) else 0.0


def _turns(episode: Episode) -> tuple[Array, Array]:
    """(n,) rad turned between scans by the odometry, (n,) by the laser, where both are known."""
    pairs = turning_pairs(episode)
    if not len(pairs):
        return np.empty(0), np.empty(0)
    heading = np.unwrap(episode.odometry.poses[:, 2])
    stamps = episode.times[pairs]
    turned = np.diff(np.interp(stamps, episode.odometry.times, heading), axis=1)[:, 0]
    largest = np.argsort(-np.abs(turned), kind="stable")[:MAX_PAIRS]
    largest = np.sort(largest[np.abs(turned[largest]) >= MIN_TURN])
    by_laser = turned_by_laser(episode.scans, pairs[largest])
    known = np.isfinite(by_laser)
    return turned[largest][known], by_laser[known]
