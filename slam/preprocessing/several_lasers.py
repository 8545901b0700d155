"""Several lasers of one robot as one recording: their scans in the order of time."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence

from slam.episode import Episode
from slam.errors import InputError
from slam.scan import Scan

TICK = 1e-6  # s by which the second of two scans of one stamp is moved


def merged(episodes: Sequence[Episode]) -> Episode:
    """One episode of the scans of several, each of one laser of the same robot and recording.

    Scans are in the order of time, each with its own mount, by the clock of the first episode:
    where the clocks of the lasers were corrected (`slam.preprocessing.clock`), by different
    offsets, the stamps of the others are moved. Odometry, truth and provenance are the first's.
    Two scans of the same stamp are moved apart by a tick. Raises InputError for an episode with
    truth, which has one pose a scan.
    """
    first, *others = episodes
    if not others:
        return first
    if any(one.truth is not None for one in episodes):
        raise InputError("episodes with the truth are of one laser, and cannot be merged")
    scans = [scan for one in episodes for scan in _on_clock(one, _offset(first))]
    ordered = _apart(sorted(scans, key=lambda scan: scan.time))
    lasers = " + ".join(str(one.meta.get("laser", "a laser")) for one in episodes)
    meta = {**first.meta, "laser": lasers}
    return dataclasses.replace(first, scans=tuple(ordered), meta=meta)


def _offset(episode: Episode) -> float:
    """s by which the odometry's stamps were found late against this laser's."""
    return float((episode.meta.get("clock") or {}).get("offset_s", 0.0))


def _on_clock(episode: Episode, offset: float) -> list[Scan]:
    """The scans with their stamps by the clock against which the odometry is late by `offset`."""
    later = _offset(episode) - offset
    if not later:
        return list(episode.scans)
    return [dataclasses.replace(scan, time=scan.time + later) for scan in episode.scans]


def _apart(scans: list[Scan]) -> list[Scan]:
    kept: list[Scan] = []
    for scan in scans:
        last = kept[-1].time if kept else -math.inf
        if scan.time <= last:
            time = max(last + TICK, math.nextafter(last, math.inf))
            scan = dataclasses.replace(scan, time=time)
        kept.append(scan)
    return kept
