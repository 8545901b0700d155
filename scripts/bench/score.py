"""`dynslam score EPISODE TRAJECTORY.tum [MAP.yaml]`: scores of any SLAM system's output."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import tyro


@dataclass
class ScoreCommand:
    """Score a trajectory, and a map if given, against the truth of a recorded episode.

    The scores are those of `dynslam bench`, at the scans within the trajectory's time span.
    """

    episode: tyro.conf.Positional[Path]
    """Episode with the truth (.npz), as `dynslam record` writes it."""
    trajectory: tyro.conf.Positional[Path]
    """The estimated trajectory in the TUM format, with the stamps of the scans."""
    map: tyro.conf.Positional[Path | None] = None
    """The estimated map, in the trajectory's frame: the YAML beside its PGM (nav2's convention)."""
    frame: Literal["anchored", "world", "aligned"] = "anchored"
    """Pose of the trajectory's frame in the world. anchored: from the true first pose; world: the
    two frames are equal; aligned: least squares fit."""
    json: bool = False
    """Print all scores as one JSON object."""

    def __call__(self) -> int:
        """Read, score, print."""
        from slam.geometry import Pose2
        from slam.io.episode_file import load_episode
        from slam.io.ros_map import read_placed_map
        from slam.io.tum import read_tum
        from slam.metrics.external import score_external

        from ..report.scores import QUALITY, present

        episode, trajectory = load_episode(self.episode), read_tum(self.trajectory)
        grid, frame = read_placed_map(self.map) if self.map is not None else (None, Pose2())
        scores = score_external(episode, trajectory, grid, frame, self.frame)
        if self.json:
            print(json.dumps(scores))
            return 0
        print(f"{scores['scans']} of {len(episode.scans)} scans")
        for score in present(QUALITY, [scores]):
            value = score.of(scores)
            assert value is not None
            print(f"{score.name:>24}: {score.told(value)}{score.unit}")
        return 0
