"""Silent wrong results: what was read is no drive of a robot, or another one when it is written and
read again."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np

from slam.episode import Episode
from slam.io.episode_file import load_episode, save_episode


def assert_episode(episode: Episode) -> None:
    """Its stamps increase, its numbers are finite, and its echoes lie within the laser's range."""
    times = episode.times
    assert np.isfinite(times).all(), "a stamp is no number"
    assert (np.diff(times) > 0).all(), "the stamps do not increase"
    assert np.isfinite(episode.odometry.at(times)).all(), "a pose is no number"
    for scan in episode.scans:
        points = scan.points
        assert len(points) == np.count_nonzero(scan.hit), "not a point for each echo"
        if len(points):
            far = np.abs(points - scan.mount[:2]).max()  # NaN if one is
            assert far <= scan.max_range * (1 + 1e-9), "an echo is beyond the range"


def episode_again(episode: Episode, path: Path) -> Episode:
    """Written as .npz, and read."""
    save_episode(episode, path)
    return load_episode(path)


def assert_kept(found: Any, again: Callable[[Any, Path], Any], path: Path) -> None:
    """What is written and read again is the same; nothing is left at `path`."""
    try:
        other = again(found, path)
    finally:
        path.unlink(missing_ok=True)
    assert_same(found, other, type(found).__name__)


def assert_same(one: Any, other: Any, where: str) -> None:
    """Equal arrays, NaN to NaN, and equal fields, members and entries."""
    if is_dataclass(one):
        pairs = {
            part.name: (getattr(one, part.name), getattr(other, part.name)) for part in fields(one)
        }
    elif isinstance(one, Mapping):
        assert one.keys() == other.keys(), f"{where}: {one.keys()} became {other.keys()}"
        pairs = {name: (one[name], other[name]) for name in one}
    elif isinstance(one, tuple | list):
        assert len(one) == len(other), f"{where}: {len(one)} became {len(other)}"
        pairs = dict(enumerate(zip(one, other, strict=True)))
    elif isinstance(one, np.ndarray):
        return np.testing.assert_array_equal(other, one, where)
    else:
        same = one == other or (one != one and other != other)
        assert same, f"{where}: {one!r} became {other!r}"
        return None
    for name, (first, second) in pairs.items():
        assert_same(first, second, f"{where}.{name}")
    return None
