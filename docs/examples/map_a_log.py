"""From a recorded drive to a map without ghosts, by a SLAM variant of one's own.

    python docs/examples/map_a_log.py --seed 5000 --out out/map-a-log

Writes map.pgm + map.yaml, as ROS takes them, of three variants, and prints how much of the doors
is left in each map. For a log of your own: `episode, _ = slam.io.formats.read_log(path)`; it
has no truth, so that there is nothing to count the doors with.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import tyro

import slam
from agents import record_path
from slam.algorithms.maximum_likelihood import MaximumLikelihood
from slam.benchmark.run import run, true_start
from slam.io.ros_map import write_ros_map
from slam.maps.hmm import HMM
from slam.metrics.change import DOOR_SHARE, TrueOccupancy
from slam.metrics.trajectory import ate


# --8<-- [start:variant]
class WithoutDoors(MaximumLikelihood):
    """Finds its way by the doors too, but draws no cell that was free longer than occupied."""

    def map(self) -> slam.OccupancyGrid:
        """What stands, as far as it does not move."""
        assert isinstance(self.map_model, HMM)
        times, grid = self.map_model.cells.tiles.dense(self.map_model.times), super().map()
        h = np.where(times[..., 0] > times[..., 1], 0.0, grid.occupied)  # s free, s occupied
        return slam.OccupancyGrid(grid.spec, h, grid.observed)


def without_doors(start: slam.Pose2, rng: np.random.Generator) -> slam.Slam:
    """The builder of the variant."""
    return WithoutDoors(start, rng, map_model=HMM())


# --8<-- [end:variant]


# --8<-- [start:count]
def door_cells(grid: slam.OccupancyGrid, truth: slam.Truth) -> int:
    """Cells that the map shows as occupied, and where truly a door stood for a part of the time."""
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
    """Record a drive in DoorCorridor-v0, map it with three variants, count what doors left."""

    seed: int = 5000
    """Seed of the drive."""
    out: Path = Path("out/map-a-log")
    """Directory to write to."""

    def __call__(self) -> dict[str, int]:
        """Record, map, count; the door cells of each variant's map."""
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
