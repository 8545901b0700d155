"""`dynslam score EPISODE TRAJECTORY.tum [MAP.yaml]`: what any SLAM system made of an episode."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import tyro

from slam.geometry import Pose2
from slam.io.episode_file import load_episode
from slam.io.ros_map import read_placed_map
from slam.io.tum import read_tum
from slam.metrics.external import score_external

from ..report.scores import QUALITY, present


@dataclass
class ScoreCommand:
    """Score a trajectory, and a map if there is one, against the truth of a recorded episode.

    The scores are those of `dynslam bench`, at the scans that the trajectory reaches.
    """

    episode: tyro.conf.Positional[Path]
    """Episode with the truth (.npz), as `dynslam record` writes it."""
    trajectory: tyro.conf.Positional[Path]
    """What the SLAM system believed, in the TUM format, with the stamps of the scans."""
    map: tyro.conf.Positional[Path | None] = None
    """Its map, as a PGM with a YAML beside it (nav2's convention), in the trajectory's frame."""
    frame: Literal["anchored", "world", "aligned"] = "anchored"
    """How the trajectory's frame lies in the world. anchored: its first pose is the true one;
    world: it is the world's; aligned: as fits best."""
    json: bool = False
    """Print all scores as one JSON object."""

    def __call__(self) -> int:
        """Read, score, print."""
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
