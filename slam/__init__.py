"""2D laser SLAM that treats change as information. Pure numpy, numba and scipy."""

from slam.episode import Episode, Truth
from slam.errors import InputError
from slam.geometry import Pose2
from slam.grid import GridSpec, OccupancyGrid
from slam.interface import Estimate, Revising, Slam
from slam.io.episode_file import load_episode, save_episode
from slam.registry import make, register, variants
from slam.scan import Scan
from slam.trajectory import Trajectory

__all__ = [
    "Episode",
    "Estimate",
    "GridSpec",
    "InputError",
    "OccupancyGrid",
    "Pose2",
    "Revising",
    "Scan",
    "Slam",
    "Trajectory",
    "Truth",
    "load_episode",
    "make",
    "register",
    "save_episode",
    "variants",
]
