"""`dynslam run LOG`: a map, a trajectory and measurements out of a recorded log."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ..recordings.source import MappedSource


@dataclass(kw_only=True)
class RunCommand(MappedSource):
    """Run a SLAM variant on a recording and measure its accuracy, time and memory.

    Writes trajectory.tum, map.pgm + map.yaml, map.png, cost.png and metrics.json. If
    earlier poses were revised, as particle filters and graphs do, also trajectory-online.tum: each
    pose as estimated at its own scan. Variants that judge whether the robot is lost also write
    lost.csv: the probability at each scan. To make a map for use, take `dynslam map`.

    Exit status: 0 done; 2 a mistake, or not all could be written; 3 all is written, but the robot
    was lost at the end, or at more than a fifth of the scans; 130 interrupted, written up to there.
    """

    slam: str = "dynamic-ml"
    """SLAM variant, such as odometry, static-ml, dynamic-ml or dynamic-graph."""
    relations: Path | None = None
    """Known relations between poses (Kuemmerle et al. 2009) to score the trajectory with."""
    out: Path | None = None
    """Directory to write to. Default: out/LOG-VARIANT."""
    seed: int = 0
    """Seed of variants that draw random numbers."""
    json: bool = False
    """Print the metrics as one JSON object, the last line of standard output."""

    def __call__(self) -> int:
        """Read, run, write, print."""
        from .run_recording import run_recording

        return run_recording(self)
