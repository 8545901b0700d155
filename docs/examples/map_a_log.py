"""Map a recorded drive without ghosts, with a SLAM variant defined here.

    python docs/examples/map_a_log.py --seed 5000 --out out/map-a-log

Writes the ROS map (map.pgm, map.yaml) of three variants and prints how many occupied cells each map
has where doors were. For a log of your own: `episode, _ = slam.read_log(path)`; without a truth
its door cells cannot be counted.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tyro

import slam
from agents import record_path
from slam import HMM, MaximumLikelihood, run, true_start
from slam.io.ros_map import write_ros_map
from slam.metrics.change import DOOR_SHARE, TrueOccupancy
from slam.metrics.trajectory import ate
from slam.recovery.watch import Watch


# --8<-- [start:variant]
class WithoutDoors(MaximumLikelihood):
    """Matches against the doors too, but exports no cell that was free longer than occupied."""

    def map(self) -> slam.OccupancyGrid:
        """The map without cells that were free for longer than occupied."""
        assert isinstance(self.map_model, HMM)
        times, grid = self.map_model.cells.tiles.dense(self.map_model.times), super().map()
        h = np.where(times[..., 0] > times[..., 1], 0.0, grid.occupied)  # s free, s occupied
        return slam.OccupancyGrid(grid.spec, h, grid.observed)


def without_doors(start: slam.Pose2, rng: np.random.Generator) -> slam.Slam:
    """The builder of the variant."""
    return WithoutDoors(start, rng, map_model=HMM(), watch=Watch())


# --8<-- [end:variant]


# --8<-- [start:count]
def door_cells(grid: slam.OccupancyGrid, truth: slam.Truth) -> int:
    """Number of occupied cells at places where a door truly was for a part of the time."""
    real = TrueOccupancy(truth, grid.spec.resolution)
    places = grid.spec.centres(np.argwhere(grid.observed & (grid.occupied > 0.5)))
    rows, cols = real.spec.cells(places).T
    inside = (rows >= 0) & (rows < real.spec.rows) & (cols >= 0) & (cols < real.spec.cols)
    share = real.share[rows[inside], cols[inside]]
    return int(((share > DOOR_SHARE[0]) & (share < DOOR_SHARE[1])).sum())


# --8<-- [end:count]


# --8<-- [start:main]
VARIANTS = ("static-ml", "hmm-ml", "without-doors")


@dataclass
class MapALog:
    """Record a drive in DoorCorridor-v0, map it with three variants, count the door cells."""

    seed: int = 5000
    """Seed of the drive."""
    out: Path = Path("out/map-a-log")
    """Directory to write to."""

    def __call__(self) -> dict[str, int]:
        """Record, map and count; returns the door cells of each variant's map."""
        slam.register("without-doors", without_doors)
        episode = record_path("DoorCorridor-v0", self.seed, doors="moving")
        truth, left = episode.truth, {}
        assert truth is not None
        for name in VARIANTS:
            result = run(slam.make(name, start=true_start(episode)), episode)
            left[name] = door_cells(result.grid, truth)
            (self.out / name).mkdir(parents=True, exist_ok=True)
            write_ros_map(result.grid, self.out / name / "map.yaml")
            error = 1e3 * ate(result.poses, truth.poses)
            print(f"{name:>14}: {left[name]} door cells in the map, ATE {error:.0f} mm")
        return left


if __name__ == "__main__":
    tyro.cli(MapALog)()
# --8<-- [end:main]
