"""Prepare a recording for SLAM: one clock, deskewed scans, odometry, compiled kernels."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

from slam.benchmark.run import warm_up
from slam.episode import Episode
from slam.errors import InputError
from slam.preprocessing.clock import Clock
from slam.preprocessing.deskewing import deskewed
from slam.preprocessing.laser_odometry import poses_by_laser, with_odometry

from ..console.progress import progress_bar
from .clocks import on_one_clock


def prepared(episode: Episode, clock: Clock | None, file: Path) -> Episode:
    """The recording with laser and odometry on one clock, by `clock` or its estimate (None), with
    deskewed scans, and with laser odometry (slow) where it has none."""
    episode = on_one_clock(episode, clock, file)
    return deskewed(episode if episode.has_odometry else _by_laser(episode))


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
