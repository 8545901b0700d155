"""Episodes as files for any SLAM system, by the name of a format."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from slam.episode import Episode


def _npz(episode: Episode, path: Path) -> Path:
    from slam.io.episode_file import save_episode

    save_episode(episode, path := path.with_suffix(".npz"))
    return path


def _carmen(episode: Episode, path: Path) -> Path:
    from slam.io.carmen.writer import write_carmen

    write_carmen(episode, path := path.with_suffix(".log.gz"))
    return path


def _plain_carmen(episode: Episode, path: Path) -> Path:
    from slam.io.carmen.writer import write_carmen

    write_carmen(episode, path := path.with_suffix(".log"))
    return path


def _csv(episode: Episode, path: Path) -> Path:
    from slam.io.csv_log import write_csv

    write_csv(episode, path := path.with_suffix(".csv"))
    return path


def _mcap(episode: Episode, path: Path) -> Path:
    from slam.io.bags.write import write_bag

    write_bag(episode, path)
    return path


def _tum(episode: Episode, path: Path) -> Path:
    from slam.io.tum import write_tum
    from slam.trajectory import Trajectory

    assert episode.truth is not None
    write_tum(Trajectory(episode.times, episode.truth.poses), path := path.with_suffix(".tum"))
    return path


Writer = Callable[[Episode, Path], Path]
"""Writes an episode to a path, the ending of its format added; returns the file or folder."""

RECORDED: dict[str, Writer] = {"npz": _npz, "carmen": _carmen, "mcap": _mcap, "tum": _tum}
"""What `dynslam record` writes; `tum` is the true trajectory."""

FOR_PROGRAMS: dict[str, Writer] = {
    "carmen": _plain_carmen, "csv": _csv, "npz": _npz, "mcap": _mcap,
}  # fmt: skip
"""What an outside program can be given."""
