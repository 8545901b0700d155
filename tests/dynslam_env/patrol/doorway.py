"""Scans of one doorway in a straight wall, and of walls without one, made by hand."""

import math

import numpy as np

from slam.scan import Scan

FACE, DEPTH, HALF_WIDTH = 2.0, 0.08, 0.45  # m: the wall's face ahead, the leaf behind it, the gap
ROOM = 5.0  # m, the wall behind an open door
BEARINGS = np.linspace(-math.pi / 2, math.pi / 2, 181)


def doorway(closed: bool, time: float = 0.0, half: float = HALF_WIDTH, seed: int = 0) -> Scan:
    """What a robot at (0, 0) that faces +y sees: its wall is at y = FACE, the gap at |x| < half."""
    ahead = np.cos(BEARINGS)
    with np.errstate(divide="ignore"):
        face = FACE / ahead
        behind = (FACE + DEPTH if closed else ROOM) / ahead
    inside = abs(face * np.sin(BEARINGS)) < half
    ranges = np.where(inside, behind, face)
    jamb = half / np.maximum(abs(np.sin(BEARINGS)), 1e-9)  # m to the planes of the jambs' sides
    ranges = np.where(inside & (jamb * ahead < FACE + 0.2), np.minimum(ranges, jamb), ranges)
    ranges = ranges + np.random.default_rng([seed, round(10 * time)]).normal(0, 0.01, len(ranges))
    return Scan(np.where(ranges < 8.0, ranges, np.inf), BEARINGS, 8.0, 0.02, time)
