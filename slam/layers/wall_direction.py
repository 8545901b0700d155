"""The direction of the walls of a building, for maps whose axes are parallel to them."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.ndimage import gaussian_filter1d

from slam.geometry import Array
from slam.layers.surface import extent, find_surface
from slam.maps.rays import Rays
from slam.scan import Scan

CELL = 0.05  # m, of the surface whose normals are counted
RIGHT_ANGLE = math.pi / 2
BINS = 900  # of a right angle: 0.1 degrees each
SMOOTHING = 5.0  # bins, standard deviation
TRIED = np.radians(np.linspace(-1.5, 1.5, 121))  # rad around the fullest bin
BAND = 0.05  # m, width of the bands parallel to the axes whose echoes are counted


def wall_direction(scans: Sequence[Scan], poses: Array) -> float:
    """rad in (-pi/4, pi/4]: the angle from the x axis, up to a right angle, of most walls that the
    scans at `poses` (n, 3) saw; 0 if they saw none. Raises InputError if the map is too large."""
    spec = extent(scans, poses, Rays(), CELL)
    surface = find_surface(scans, poses, Rays(), spec)
    walls = surface.normals.any(axis=1)
    if not walls.any():
        return 0.0
    rough = _fullest(surface.normals[walls])
    values = [_sharpness(surface.places[walls], rough + off) for off in TRIED.tolist()]
    best = rough + TRIED[int(np.argmax(values))]
    return float(_folded(np.array([best]))[0])


def _fullest(normals: Array) -> float:
    """rad: the direction, up to a right angle, of most of the normals (n, 2)."""
    angles = np.arctan2(normals[:, 1], normals[:, 0]) % RIGHT_ANGLE
    counts, edges = np.histogram(angles, BINS, (0.0, RIGHT_ANGLE))
    smooth = gaussian_filter1d(counts.astype(np.float64), SMOOTHING, mode="wrap")
    return float(edges[int(np.argmax(smooth))]) + RIGHT_ANGLE / BINS / 2


def _sharpness(points: Array, angle: float) -> float:
    """Sum of squares of the numbers of `points` (n, 2) in bands along two axes turned by `angle`:
    the largest where walls are parallel to the axes."""
    c, s = math.cos(angle), math.sin(angle)
    along = points @ np.array([[c, -s], [s, c]])
    bands = np.floor((along - along.min(axis=0)) / BAND).astype(np.int64)
    return float(sum((np.bincount(column).astype(np.float64) ** 2).sum() for column in bands.T))


def _folded(angles: Array) -> Array:
    """Angles, rad, less the right angles that they hold: in (-pi/4, pi/4]."""
    return RIGHT_ANGLE / 2 - (RIGHT_ANGLE / 2 - angles) % RIGHT_ANGLE
