"""Brier score of the dynamic map for the doors that are closed now, by the truth."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dynslam_env.patrol.memory import CELL_SIZE, DynamicMap
from dynslam_env.worlds.layout import Door, Layout
from slam.geometry import Array
from slam.kernel import kernel

CLOSED_ANGLE = 0.2  # rad: a door that is open no wider counts as closed
LEAF_SHARES = np.linspace(0.15, 0.85, 8)  # of a closed leaf's width, where the map is read
SIDE_CELLS = np.array([-1.0, 0.0, 1.0])  # cells beside the leaf: tolerance for the pose's error
BESIDE = SIDE_CELLS * CELL_SIZE  # m
UNSEEN_P_CLOSED = 0.5  # P(closed) of a door that was never observed


class DoorsKnown:
    """Reads P(closed) of a layout's doors from the dynamic map."""

    def __init__(self, layout: Layout):
        self._points = _points(layout.doors).reshape(-1, 2)
        self._shape = len(layout.doors), len(LEAF_SHARES), len(SIDE_CELLS)

    def near(self, memory: DynamicMap, time: float) -> Array:
        """(d, LEAF_SHARES, SIDE_CELLS) P(occupied at `time`) along the closed leaves and beside
        them; NaN where never observed."""
        return memory.occupied(self._points, time).reshape(self._shape)

    def brier(self, memory: DynamicMap, time: float, openings: Array) -> float:
        """See the function."""
        return float(brier(self.near(memory, time), openings))


def closed(near: Array) -> Array:
    """(..., d) P(closed) of doors, from `DoorsKnown.near` (..., d, LEAF_SHARES, SIDE_CELLS).

    The mean along the leaf of the largest P(occupied) across it; UNSEEN_P_CLOSED where never
    observed."""
    along = np.fmax.reduce(near, axis=-1)
    seen = along == along  # not NaN
    total = np.add.reduce(np.where(seen, along, 0.0), axis=-1)
    number = np.add.reduce(seen, axis=-1, dtype=np.int64)
    return np.where(number > 0, total / np.maximum(number, 1), UNSEEN_P_CLOSED)


def brier(near: Array, openings: Array) -> Array:
    """(...) mean squared difference of P(closed) and the truth (Brier 1950), of doors at `openings`
    (..., d) rad; NaN without doors."""
    if not openings.shape[-1]:
        return np.full(openings.shape[:-1], np.nan)
    errors = closed(near) - (openings < CLOSED_ANGLE)
    return np.add.reduce(errors**2, axis=-1) / errors.shape[-1]


def _points(doors: Sequence[Door]) -> Array:
    """(d, LEAF_SHARES, SIDE_CELLS, 2) m, points along the closed leaves and beside them."""
    rows = [(*door.hinge, door.closed, door.swing, door.width, door.thickness) for door in doors]
    leaves = np.array(rows, dtype=np.float64).reshape(-1, 6)
    closed = leaves[:, 2]
    return _beside_leaves(leaves, np.cos(closed), np.sin(closed), LEAF_SHARES, BESIDE)


@kernel
def _beside_leaves(leaves, cosines, sines, shares, beside):
    """Points at `shares` of the width of each leaf, and `beside` its middle line, m."""
    found = np.empty((len(leaves), len(shares), len(beside), 2))
    for d in range(len(leaves)):
        x, y, _, swing, width, thickness = leaves[d]
        c, s, depth = cosines[d], sines[d], 0.5 * swing * thickness
        for k in range(len(shares)):
            along = width * shares[k]
            for side in range(len(beside)):
                found[d, k, side, 0] = x + depth * s + along * c - beside[side] * s
                found[d, k, side, 1] = y - depth * c + along * s + beside[side] * c
    return found
