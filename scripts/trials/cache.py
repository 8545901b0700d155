"""Drives that were recorded before: a folder of episodes, each named by what it is of."""

from __future__ import annotations

import os
import time
from contextlib import suppress
from pathlib import Path

from slam.episode import Episode
from slam.errors import InputError
from slam.io.episode_file import load_episode, save_episode

from .sources import SimulatedDrive, Source

FOLDER = "DYNSLAM_CACHE"
MOST_BYTES = 4_000_000_000
DAY = 86400.0  # s


def folder() -> Path:
    """Where episodes are kept: $DYNSLAM_CACHE, or dynslam/ in the user's own cache folder."""
    given = os.environ.get(FOLDER)
    if given:
        return Path(given)
    if os.name == "nt":
        return Path(os.environ.get("LOCALAPPDATA", Path.home())) / "dynslam"
    return Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "dynslam"


def episode_of(source: Source) -> Episode:
    """The episode of `source`, recorded, and kept if that can be, if it is not there. Logs are read
    as they are."""
    if not isinstance(source, SimulatedDrive):
        return source.make()
    path = path_of(source)
    if path.exists():
        try:
            episode = load_episode(path)
            with suppress(OSError):  # another user's
                os.utime(path)
            return episode
        except InputError:  # damaged: it is made anew
            pass
    episode = source.make()
    with suppress(OSError, InputError):  # a full disk costs the time to record it again, no more
        path.parent.mkdir(parents=True, exist_ok=True)
        save_episode(episode, path)
    return episode


def path_of(source: Source) -> Path:
    """The file that it is kept in."""
    return folder() / f"{source.key}.npz"


def prune(most: int = MOST_BYTES) -> None:
    """Delete what was not used for the longest time, until `most` bytes are left; and what a killed
    process left half written. Another may do the same at the same time."""
    found = []
    for path in (*folder().glob("*.npz"), *folder().glob(".*.npz.*.tmp")):
        with suppress(FileNotFoundError):
            found.append((path.stat().st_mtime, path.stat().st_size, path))
    total = 0
    for used, size, path in sorted(found, reverse=True):
        total += size
        if total > most or (path.suffix == ".tmp" and time.time() - used > DAY):
            with suppress(OSError):
                path.unlink()
