"""Maps drawn with letters: `#` occupied, `.` free, a blank unknown, `~` seen to change; the first
line is the top."""

import numpy as np

from dynslam_env.navigation.beliefs import Beliefs
from dynslam_env.navigation.costmap import Costmap, Inflation, inflated
from slam.grid import GridSpec

BARE = Inflation(margin=0.0, weight=0.0)
POINT = 1e-3  # m, radius of a robot that fits everywhere


def letters(text: str) -> np.ndarray:
    lines = [line for line in text.splitlines() if line]
    width = max(len(line) for line in lines)
    return np.array([list(line.ljust(width)) for line in lines])[::-1]


def drawn(text: str, radius: float = POINT, inflation: Inflation = BARE) -> Costmap:
    cells = letters(text)
    spec = GridSpec(0.1, 0, 0, *cells.shape)
    none = np.zeros(cells.shape, dtype=np.bool_)
    return inflated(spec, cells == "#", cells != " ", none, radius, inflation)


def believed(text: str, cell: float = 0.15) -> Beliefs:
    cells = letters(text)
    occupied = np.where(cells == "#", 1.0, np.where(cells == "~", 0.5, 0.0)).astype(np.float32)
    observed = cells != " "
    age = np.where(observed, 1.0, np.inf).astype(np.float32)
    flips = np.where(cells == "~", 0.1, 0.0).astype(np.float32)
    return Beliefs(GridSpec(cell, 0, 0, *cells.shape), occupied, observed, age, flips)
