"""Any file that people bring becomes an Episode, and an Episode any file that people take away.

What a file is, is told by its first bytes; what is to be written, by the ending of its name.
"""

from __future__ import annotations

import codecs
import dataclasses
from collections.abc import Callable
from pathlib import Path

import numpy as np

from slam.episode import Episode
from slam.errors import InputError
from slam.io import signatures
from slam.io.arrays import names
from slam.io.carmen.reader import read_carmen
from slam.io.carmen.writer import write_carmen
from slam.io.csv_log import read_csv, write_csv
from slam.io.episode_file import load_episode, save_episode
from slam.io.files import AnyPath, lines, reading
from slam.io.loaded_recording import LoadedRecording, SourceSelection
from slam.io.plain_npz import read_plain_npz
from slam.trajectory import Trajectory


def kind_of(path: AnyPath) -> str:
    """What a file is: bag, episode, npz, csv or carmen. Raises InputError if it cannot be read."""
    path = Path(path)
    if path.is_dir():
        return "bag"
    with reading(path) as file:
        start = file.read(16)
    if start.startswith((signatures.ROS1, signatures.MCAP, signatures.SQLITE)):
        return "bag"
    if start.startswith(b"PK\x03\x04"):
        return "episode" if "format" in names(path) else "npz"
    return "csv" if _is_table(path) else "carmen"


def read_log(path: AnyPath, choice: SourceSelection = SourceSelection()) -> LoadedRecording:
    """Read a recording of any known format. Raises InputError where it is none, or cannot be used.

    What `choice` leaves open is found in the file. Only a bag has several lasers and odometries.
    """
    kind = kind_of(path)
    if kind == "bag":
        from slam.io.bags import read_bag

        return read_bag(path, choice)
    if choice.laser is not None or choice.odometry not in (None, "none"):
        raise InputError(f"{path}: only a ROS bag has several lasers or odometries to choose from")
    return _chosen(READERS[kind](path), choice)


def check_ending(path: AnyPath) -> str:
    """The ending of a name that `write_log` can write. Raises InputError for any other."""
    name = Path(path).name
    ending = max((one for one in WRITERS if name.endswith(one)), key=len, default="")
    if not name or (not ending and Path(path).suffix):
        raise InputError(
            f"{path}: the ending tells what is written: {', '.join(filter(None, WRITERS))}, or "
            f"none for a ROS 2 bag in a folder"
        )
    return ending


def write_log(episode: Episode, path: AnyPath) -> None:
    """Write `path`: .npz (all of it), .csv, .log or .log.gz (CARMEN), .bag (ROS 1), .mcap or .db3
    (ROS 2), or without an ending, a ROS 2 bag in a folder. Raises InputError."""
    WRITERS[check_ending(path)](episode, Path(path))


def _chosen(log: LoadedRecording, choice: SourceSelection) -> LoadedRecording:
    episode = log.episode
    if choice.mount is not None:
        scans = (dataclasses.replace(scan, mount=choice.mount) for scan in episode.scans)
        episode = dataclasses.replace(episode, scans=tuple(scans))
    if choice.odometry == "none":
        still = Trajectory(episode.times, np.zeros((len(episode.scans), 3)))
        meta = {**episode.meta, "odometry": ""}
        episode = dataclasses.replace(episode, odometry=still, meta=meta)
    return log._replace(episode=episode)


def _is_table(path: Path) -> bool:
    """Whether the first line that is no comment names columns."""
    for number, line in lines(path):
        text = line.removeprefix(codecs.BOM_UTF8).strip()
        if text and not text.startswith(b"#"):
            return text.lstrip(b'"').lower().startswith(b"time")
        if number > 1000:
            break
    return False


def _read_episode(path: AnyPath) -> LoadedRecording:
    return LoadedRecording(load_episode(path), ())


def _write_bag(episode: Episode, path: Path) -> None:
    from slam.io.bags import write_bag

    write_bag(episode, path)


READERS: dict[str, Callable[[AnyPath], LoadedRecording]] = {
    "episode": _read_episode,
    "npz": read_plain_npz,
    "csv": read_csv,
    "carmen": read_carmen,
}
WRITERS: dict[str, Callable[[Episode, Path], None]] = {
    ".npz": save_episode,
    ".csv": write_csv,
    ".log": write_carmen,
    ".log.gz": write_carmen,
    ".bag": _write_bag,
    ".mcap": _write_bag,
    ".db3": _write_bag,
    "": _write_bag,
}
