"""Prepare a recording for SLAM: one clock, deskewed scans, odometry, compiled kernels."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from slam.benchmark.run import warm_up
from slam.episode import Episode
from slam.errors import InputError
from slam.preprocessing.clock import Clock
from slam.preprocessing.deskewing import deskewed
from slam.preprocessing.laser_odometry import poses_by_laser, with_odometry
from slam.preprocessing.several_lasers import merged

from ..console.progress import progress_bar
from .clocks import on_one_clock
from .laser_check import turned_upright


def prepared(
    lasers: Sequence[Episode], clock: Clock | None, file: Path
) -> tuple[Episode, tuple[str, ...]]:
    """The recording as one episode of all its lasers, and what was corrected, in words.

    Each laser is turned over if it sees the world mirrored, put on one clock with the odometry, by
    `clock` or its estimate (None), and its scans are deskewed. A recording without odometry gets
    that of its first laser (slow). Raises InputError for one of several lasers that does not turn
    with the robot.
    """
    upright, told = turned_upright(lasers, file)
    several = len(upright) > 1
    names = [f"{file}, {one.meta.get('laser')}" if several else str(file) for one in upright]
    first, *others = (
        on_one_clock(one, clock, name) for one, name in zip(upright, names, strict=True)
    )
    if not first.has_odometry:
        first = _by_laser(first)
        others = [dataclasses.replace(one, odometry=first.odometry, meta=first.meta)
                  for one in others]  # fmt: skip
    return merged([deskewed(one) for one in (first, *others)]), told


def _by_laser(episode: Episode) -> Episode:
    with progress_bar() as progress:
        poses = list(
            progress.track(
                poses_by_laser(episode), len(episode.scans), description="odometry by laser"
            )
        )
    return with_odometry(episode, poses)


def compile_first(variant: str, episode: Episode) -> None:
    """Compile the kernels of a variant, or read them from the cache."""
    with progress_bar() as progress:
        progress.add_task("preparing kernels", total=None)
        with suppress(InputError):  # the run itself meets the same error, and keeps its results
            warm_up(variant, episode)
