"""Scans of straight walls, made by hand."""

import math

import numpy as np
from numpy.typing import ArrayLike

from slam import Pose2
from slam.scan import Scan

HALF = 0.4  # rad, half of the field of view
UP = Pose2(0.0, 0.0, math.pi / 2)


def fan(ranges: ArrayLike, time: float = 0.0, half: float = HALF) -> Scan:
    """A scan whose beams are spread evenly, right to left."""
    found = np.asarray(ranges, np.float64)
    return Scan(found, np.linspace(-half, half, len(found)), 8.0, 0.02, time)


def wall(ahead: float, time: float = 0.0, beams: int = 41) -> Scan:
    """What is seen of a wall across the way, so many m ahead."""
    return fan(ahead / np.cos(np.linspace(-HALF, HALF, beams)), time)
