"""Recordings of any file format to Episodes, and Episodes to any file format.

The format is recognised by the content of a file when reading, and by the ending of its name when
writing. `register_reader` adds a custom format; installed packages add theirs by an entry
point of the group `dynslam.readers`, whose object is a `Reader`.
"""

from __future__ import annotations

import codecs
import dataclasses
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from slam.episode import Episode
from slam.errors import InputError
from slam.io.arrays import names
from slam.io.carmen.reader import read_carmen
from slam.io.carmen.writer import write_carmen
from slam.io.csv_log import read_csv, write_csv
from slam.io.episode_file import load_episode, save_episode
from slam.io.files import (
    MCAP_MAGIC,
    ROS1_MAGIC,
    SQLITE_MAGIC,
    ZIP_MAGIC,
    AnyPath,
    lines,
    reading,
)
from slam.io.guard import guarded
from slam.io.loaded_recording import LoadedRecording, SourceSelection
from slam.io.plain_npz import read_plain_npz
from slam.plugins import load_entry_points
from slam.trajectory import Trajectory
from slam.validation import function, instance

HEAD_BYTES = 64  # first bytes of a file, given to a reader to recognise its format
MAX_HEAD_LINES = 1000  # comments before a table's line of names


class Reader(NamedTuple):
    """How files of one format are recognised and read.

    recognises  (path, head) -> bool; `head` is the first 64 bytes, empty for a folder
    read        path -> `Episode`, or `LoadedRecording` with warnings; raises InputError
    """

    recognises: Callable[[Path, bytes], bool]
    read: Callable[[Path], Episode | LoadedRecording]


def register_reader(
    kind: str,
    recognises: Callable[[Path, bytes], bool],
    read: Callable[[Path], Episode | LoadedRecording],
) -> None:
    """Register a file format as `kind` in this process; see `Reader`.

    It is tried before the built-in formats. Raises InputError for the name of one of these.
    """
    if kind in OWN_READERS:
        raise InputError(f"{kind!r} is one of dynslam's own formats; choose another name")
    function(f"recognises of {kind!r}", recognises)
    function(f"read of {kind!r}", read)
    _READERS[kind] = Reader(recognises, read)


def kind_of(path: AnyPath) -> str:
    """The format of a file: bag, episode, npz, csv, carmen, or a registered one's name. Raises
    InputError if it cannot be read."""
    registered = _registered_kind(Path(path))
    return registered or _kind_among(OWN_READERS, Path(path))


def has_registered_reader(path: AnyPath) -> bool:
    """Whether a file is of a registered format rather than a built-in one."""
    return bool(_registered_kind(Path(path)))


def _registered_kind(path: Path) -> str:
    _discover()
    return _kind_among(_READERS, path) if _READERS else ""


def _kind_among(readers: dict[str, Reader], path: Path) -> str:
    """The first of the formats that recognises the file; empty if none does."""
    head = b""
    if not path.is_dir():
        with reading(path) as file:
            head = file.read(HEAD_BYTES)
    return next((kind for kind, reader in readers.items() if reader.recognises(path, head)), "")


def read_log(path: AnyPath, choice: SourceSelection = SourceSelection()) -> LoadedRecording:
    """Read a recording of any known format. Raises InputError if it cannot be read as one.

    What `choice` leaves unspecified is detected. Only a bag has several lasers and odometries.
    """
    with guarded(path):
        return _read_log(path, choice)


def _read_log(path: AnyPath, choice: SourceSelection) -> LoadedRecording:
    kind = kind_of(path)
    if kind == "bag":
        return _read_bag(Path(path), choice)
    if choice.laser is not None or choice.odometry not in (None, "none"):
        raise InputError(f"{path}: only a ROS bag has several lasers or odometries to choose from")
    return _chosen(_read(kind, Path(path)), choice)


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


def _read(kind: str, path: Path) -> LoadedRecording:
    found = (OWN_READERS.get(kind) or _READERS[kind]).read(path)
    if isinstance(found, Episode):
        return LoadedRecording(found, ())
    expected = "an Episode or a LoadedRecording"
    instance(f"{path}: what the reader {kind!r} returns", found, LoadedRecording, expected)
    return found


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


def _is_bag(path: Path, head: bytes) -> bool:
    return path.is_dir() or head.startswith((ROS1_MAGIC, MCAP_MAGIC, SQLITE_MAGIC))


def _is_episode(path: Path, head: bytes) -> bool:
    return _is_npz(path, head) and "format" in names(path)


def _is_npz(path: Path, head: bytes) -> bool:
    return head.startswith(ZIP_MAGIC)


def _is_table(path: Path, head: bytes) -> bool:
    """Whether the first line that is not a comment names columns."""
    for number, line in lines(path):
        text = line.removeprefix(codecs.BOM_UTF8).strip()
        if text and not text.startswith(b"#"):
            return text.lstrip(b'"').lower().startswith(b"time")
        if number > MAX_HEAD_LINES:
            break
    return False


def _read_bag(path: Path, choice: SourceSelection = SourceSelection()) -> LoadedRecording:
    from slam.io.bags import read_bag

    return read_bag(path, choice)


def _write_bag(episode: Episode, path: Path) -> None:
    from slam.io.bags import write_bag

    write_bag(episode, path)


@cache
def _discover() -> None:
    """Register the readers of all installed packages, once."""
    load_entry_points(
        "dynslam.readers",
        _READERS.__contains__,
        lambda kind, reader: register_reader(kind, *reader),
    )


_READERS: dict[str, Reader] = {}
OWN_READERS = {
    "bag": Reader(_is_bag, _read_bag),
    "episode": Reader(_is_episode, load_episode),
    "npz": Reader(_is_npz, read_plain_npz),
    "csv": Reader(_is_table, read_csv),
    "carmen": Reader(lambda path, head: True, read_carmen),
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
