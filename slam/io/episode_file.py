"""Episodes as .npz files."""

from __future__ import annotations

import json
import os
from typing import Any

import numpy as np

from slam.episode import Episode, Truth
from slam.errors import InputError
from slam.io.arrays import floats, parsed
from slam.io.files import replacing
from slam.io.scan_arrays import packed_scans, unpacked_scans
from slam.trajectory import Trajectory

FORMAT = "dynslam-episode-1"
WHAT = "an episode saved by dynslam"


def save_episode(episode: Episode, path: str | os.PathLike[str]) -> None:
    """Write `episode` to `path` (.npz) atomically: a killed run leaves no partial file.

    Raises InputError if it cannot be written.
    """
    arrays: dict[str, Any] = {
        "format": FORMAT,
        "meta": json.dumps(dict(episode.meta)),
        **packed_scans(episode.scans),
        "odometry_times": episode.odometry.times,
        "odometry_poses": episode.odometry.poses,
    }
    if episode.truth is not None:
        arrays |= {
            "truth_poses": episode.truth.poses,
            "truth_walls": episode.truth.walls,
            "truth_doors": episode.truth.doors,
        }
    with replacing(path) as file:
        np.savez_compressed(file, **arrays)


def load_episode(path: str | os.PathLike[str]) -> Episode:
    """Read a file of `save_episode`. Raises InputError for any other; never runs a pickle."""
    return parsed(path, WHAT, FORMAT, _episode)


def _episode(data: dict[str, Any]) -> Episode:
    truth = None
    if "truth_poses" in data:
        poses, walls = floats(data["truth_poses"], 2), floats(data["truth_walls"], 2)
        truth = Truth(poses, walls, floats(data["truth_doors"], 3))
        if (poses.shape[1], walls.shape[1]) != (3, 4) or truth.doors.shape[::2] != (len(poses), 4):
            raise InputError("the truth has poses (n, 3), walls (w, 4) and doors (n, d, 4)")
    odometry = Trajectory(floats(data["odometry_times"], 1), floats(data["odometry_poses"], 2))
    meta = json.loads(str(data["meta"]))
    if not isinstance(meta, dict):
        raise InputError("meta must be an object of JSON")
    episode = Episode(unpacked_scans(data), odometry, truth, meta)
    if (np.diff(episode.times) <= 0).any():
        raise InputError("the stamps of scans increase, in this file they do not")
    return episode
