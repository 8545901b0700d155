"""Cache of simulated episodes: a folder of files, named by the content of their source."""

from __future__ import annotations

import os
import sys
import time
from contextlib import suppress
from dataclasses import replace
from functools import cache
from pathlib import Path

from slam.episode import Episode
from slam.errors import InputError
from slam.io.episode_file import load_episode, save_episode
from slam.temporary import is_writable, own_folder

from .sources import SimulatedDrive, Source

FOLDER_VARIABLE = "DYNSLAM_CACHE"
KEY = "cached as"  # in the meta of a file: the key of its source
MAX_BYTES = 4_000_000_000
DAY = 86400.0  # s


def folder() -> Path:
    """Folder of the cache: `usual_folder`, or a temporary one of this user if that is read-only."""
    return _writable(usual_folder())


def usual_folder() -> Path:
    """$DYNSLAM_CACHE, or dynslam/ in the user's cache folder; temporary for a user without one."""
    given = os.environ.get(FOLDER_VARIABLE)
    if given:
        return Path(given)
    if os.name == "nt":
        return Path(os.environ.get("LOCALAPPDATA", Path.home())) / "dynslam"
    return Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache")) / "dynslam"


@cache
def _writable(usual: Path) -> Path:
    if is_writable(usual):
        return usual
    found = own_folder() / "drives"
    print(f"{usual}: cannot be written; drives are recorded into {found}", file=sys.stderr)
    return found


def episode_of(source: Source) -> Episode:
    """The episode of `source`, from the cache if it is there; else recorded and cached.

    Logs are read directly.
    """
    if not isinstance(source, SimulatedDrive):
        return source.make()
    path = path_of(source)
    if path.exists():
        try:
            episode = _unmarked(load_episode(path), source)
            with suppress(OSError):  # the file of another user
                os.utime(path)
            return episode
        except InputError:  # damaged, or another drive: record it again
            pass
    episode = source.make()
    with suppress(OSError, InputError):  # without a cache, it is recorded again next time
        path.parent.mkdir(parents=True, exist_ok=True)
        save_episode(replace(episode, meta={**episode.meta, KEY: source.key}), path)
    return episode


def _unmarked(episode: Episode, source: SimulatedDrive) -> Episode:
    """The episode as it was recorded. Raises InputError for that of another source."""
    meta = dict(episode.meta)
    if meta.pop(KEY, None) != source.key:
        raise InputError("the drive of another source")
    return replace(episode, meta=meta)


def path_of(source: Source) -> Path:
    """The cache file of a source: in the usual folder if it lies there already, even read-only."""
    found = usual_folder() / f"{source.key}.npz"
    return found if found.exists() else folder() / found.name


def prune(max_bytes: int = MAX_BYTES) -> None:
    """Delete the least recently used files beyond `max_bytes`, and half-written files of killed
    processes. Other processes may prune at the same time."""
    found = []
    for path in (*folder().glob("*.npz"), *folder().glob(".*.npz.*.tmp")):
        with suppress(FileNotFoundError):
            found.append((path.stat().st_mtime, path.stat().st_size, path))
    total = 0
    for used, size, path in sorted(found, reverse=True):
        total += size
        if total > max_bytes or (path.suffix == ".tmp" and time.time() - used > DAY):
            with suppress(OSError):
                path.unlink()
