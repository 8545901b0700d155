"""The trajectory that an outside program wrote: columns of numbers, in a choice of stamps."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from slam.episode import Episode
from slam.errors import InputError
from slam.geometry import Array
from slam.io.number_columns import read_columns
from slam.io.tum import read_tum
from slam.trajectory import Trajectory
from slam.validation import one_of

PLAIN = "tum"
POSE = ("stamp", "x", "y", "theta")
SKIPPED = "-"
STAMPS = ("recording", "start", "scan")
"""recording: the stamps of the scans; start: s since the first scan; scan: its number, from 0."""


def check_columns(columns: str) -> None:
    """Raise InputError unless `columns` is `tum`, or names stamp, x, y and theta once each."""
    if columns == PLAIN:
        return
    names = columns.split()
    for name in names:
        one_of("a name in columns", name, (*POSE, SKIPPED))
    if sorted(set(names) - {SKIPPED}) != sorted(POSE) or len(names) - names.count(SKIPPED) != 4:
        raise InputError(f"columns must be `tum` or name {', '.join(POSE)} once, got {columns!r}")


def read_result(
    path: Path, episode: Episode, columns: str = PLAIN, stamps: str = "recording", offset: float = 0
) -> Trajectory:
    """The poses in a file, with the stamps of the recording. Of poses with one stamp the last one.

    offset  s, added to the stamps

    Raises InputError for a file that cannot be read, without a pose, or with stamps that go back.
    """
    given = read_tum(path) if columns == PLAIN else _of_columns(path, columns.split())
    return Trajectory(_recorded(given.times, episode, stamps) + offset, given.poses)


def _of_columns(path: Path, names: list[str]) -> Trajectory:
    rows, _ = read_columns(path, " ".join(names))
    if not len(rows):
        raise InputError(f"{path}: no pose in it, expected lines of `{' '.join(names)}`")
    times, x, y, theta = (rows[:, names.index(name)] for name in POSE)
    last = np.append(np.diff(times) != 0, True)
    return Trajectory(times[last], np.column_stack([x, y, theta])[last])


def _recorded(times: Array, episode: Episode, stamps: str) -> Array:
    scans = episode.times
    if stamps == "start":
        return times + scans[0]
    if stamps == "recording":
        return times
    numbers = times.astype(int)
    if (numbers != times).any() or numbers[0] < 0 or numbers[-1] >= len(scans):
        raise InputError(f"the stamps must be numbers of scans from 0 to {len(scans) - 1}")
    return scans[numbers]
