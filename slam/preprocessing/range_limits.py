"""Narrower limits of a laser's ranges than its recording states."""

from __future__ import annotations

import dataclasses

from slam.episode import Episode
from slam.errors import InputError
from slam.scan import Scan


def with_ranges(episode: Episode, low: float | None, high: float | None) -> Episode:
    """The episode whose echoes nearer than `low` (m) are no readings, and whose echoes from `high`
    (m) on are no echoes, as if the laser reached no farther; None: as recorded.

    Limits outside of the laser's own change nothing. Raises InputError unless 0 <= low < high, and
    where no echo of any scan is left.
    """
    if low is None and high is None:
        return episode
    scans = tuple(_limited(scan, low, high) for scan in episode.scans)
    if not any(scan.hit.any() for scan in scans):
        raise InputError(
            f"no echo is left between {scans[0].min_range:g} and {scans[0].max_range:g} m"
        )
    return dataclasses.replace(episode, scans=scans)


def _limited(scan: Scan, low: float | None, high: float | None) -> Scan:
    nearest = scan.min_range if low is None else max(low, scan.min_range)
    farthest = scan.max_range if high is None else min(high, scan.max_range)
    if not 0.0 <= nearest < farthest:
        raise InputError(
            f"the ranges to use must begin below their end, got {nearest:g} to {farthest:g} m "
            f"(the laser's own: {scan.min_range:g} to {scan.max_range:g} m)"
        )
    return dataclasses.replace(scan, min_range=nearest, max_range=farthest)
