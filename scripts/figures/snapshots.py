"""Snapshots: what a SLAM believed on the way, every few scans, for a picture that moves."""

from __future__ import annotations

from typing import NamedTuple

from slam.benchmark.run import Playback
from slam.episode import Episode
from slam.errors import InputError
from slam.geometry import Array
from slam.grid import OccupancyGrid
from slam.interface import Slam


class Snapshot(NamedTuple):
    """A SLAM after scan number `scan`.

    poses  (scan + 1, 3) as estimated at each scan up to this one
    grid   the map, a copy of its own
    """

    scan: int
    poses: Array
    grid: OccupancyGrid


def take_snapshots(slam: Slam, episode: Episode, every: int = 5) -> list[Snapshot]:
    """Run `slam` over the episode; its state after every `every`th scan, and after the last."""
    if every < 1:
        raise InputError(f"snapshots are taken every 1 scan or more, got every={every}")
    playback, last = Playback(slam, episode), len(episode.scans) - 1
    snapshots = []
    for number, _ in enumerate(playback):
        if number % every == 0 or number == last:
            run = playback.result()
            snapshots.append(Snapshot(number, run.poses, run.grid))
    return snapshots
