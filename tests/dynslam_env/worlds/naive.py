"""Slow, obvious looks at a world: points on a raster, leaves at many angles."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
from scipy import ndimage

from tests.dynslam_env.naive import leaf

CELL = 0.05  # m
ANGLES = np.linspace(0.0, math.pi / 2, 19)


def distances(points, segments):
    """(n,) m, from each point to the nearest segment."""
    (x, y), (a, b, c, d) = points.T[..., None], segments.T
    along = ((x - a) * (c - a) + (y - b) * (d - b)) / ((c - a) ** 2 + (d - b) ** 2)
    share = np.clip(along, 0, 1)
    return np.hypot(a + share * (c - a) - x, b + share * (d - b) - y).min(axis=1)


def along(points, spacing=0.02):
    """(n, 2) points at most `spacing` m apart along a polyline."""
    legs = pairwise(points)
    steps = [(a, b, np.linspace(0, 1, 2 + int(math.dist(a, b) / spacing))) for a, b in legs]
    return np.vstack([a + t[:, None] * (b - a) for a, b, t in steps])


def reached(layout, points):
    """Which points a flood from the start comes to, and whether it leaks out; doors are open."""
    low, high = layout.walls.reshape(-1, 2).min(axis=0) - 1, layout.walls.reshape(-1, 2).max(0) + 1
    solid = np.zeros(np.ceil((high - low) / CELL).astype(int) + 1, dtype=bool)
    for wall in layout.walls:
        solid[cells(along(wall.reshape(2, 2), CELL / 5), low)] = True
    areas = np.zeros(solid.shape, dtype=int)
    ndimage.label(~solid, output=areas)  # 4-neighbours: no leak between diagonal cells
    home = areas[cells(np.array([layout.start[:2]]), low)][0]
    assert home
    return areas[cells(points, low)] == home, areas[0, 0] == home


def cells(points, low):
    i, j = np.floor((points - low) / CELL).astype(int).T
    return i, j


def swept(door, spacing=0.05):
    """(n, 2) points of a leaf at many angles."""
    outlines = [leaf(door, door.closed + door.swing * angle) for angle in ANGLES]
    return np.vstack([along(each.reshape(2, 2), spacing) for lines in outlines for each in lines])


def covers(door, points, margin=0.0):
    """Which points are where the leaf swings, or within `margin` m of there."""
    x, y = (points - door.hinge).T
    c, s = math.cos(door.closed), math.sin(door.closed)
    ahead, aside = c * x + s * y, door.swing * (c * y - s * x)
    inside = (ahead > -margin) & (aside > -door.thickness - margin)
    return inside & (np.hypot(ahead, aside) < door.width + margin)


def crossings(legs, walls):
    """How many legs (n, 4) properly cross a wall."""
    a, b, c, d = (legs[:, None, :2], legs[:, None, 2:], walls[None, :, :2], walls[None, :, 2:])
    return int(((_turn(a, b, c) * _turn(a, b, d) < -1e-12)
                & (_turn(c, d, a) * _turn(c, d, b) < -1e-12)).sum())  # fmt: skip


def _turn(a, b, c):
    return (b - a)[..., 0] * (c - a)[..., 1] - (b - a)[..., 1] * (c - a)[..., 0]
