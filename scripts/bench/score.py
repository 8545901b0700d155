"""`dynslam score EPISODE TRAJECTORY.tum [MAP.yaml] ...`: scores of any SLAM system's output."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import tyro


@dataclass
class ScoreCommand:
    """Score trajectories, and maps if given, against the truth of recorded episodes.

    The scores are those of `dynslam bench`, at the scans within each trajectory's time span.
    """

    episode: tyro.conf.Positional[Path]
    """Episode with the truth (.npz), as `dynslam record` writes it; or a folder of them: a
    trajectory belongs to the episode whose name its own, or that of its folder, begins with."""
    files: tyro.conf.Positional[tuple[Path, ...]]
    """Estimated trajectories in the TUM format, with the stamps of the scans. A file that ends in
    .yaml is the map of the trajectory before it, in the same frame (nav2's convention)."""
    frame: Literal["anchored", "world", "aligned"] = "anchored"
    """Pose of the trajectory's frame in the world. anchored: from the true first pose; world: the
    two frames are equal; aligned: least squares fit."""
    offset: float = 0.0
    """Added to the stamps of the trajectories, in s: for a system with a clock of its own."""
    json: bool = False
    """Print all scores as one JSON object; of several trajectories as a list."""

    def __call__(self) -> int:
        """Read, score, print."""
        from .score_files import score_files

        return score_files(self)
