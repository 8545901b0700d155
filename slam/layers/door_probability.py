"""The probability that a gap whose cells changed is a door, by its shape and by what was seen."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.ndimage import binary_dilation

from slam.geometry import Array
from slam.grid import GridSpec
from slam.layers.classification import EIGHT_NEIGHBOURS, STATIC

WALL_FROM, WALL_TO = 0.05, 0.45  # m beyond the ends of a gap, where a wall goes on
BESIDE_LINE = 2  # cells to either side of a gap's line, up to which the wall is in it
FLAT = 0.03  # m, deviation of a leaf's echoes from its line, of the order of the errors of poses
BIAS = -5.6  # nats; with the weights of `Evidence`, by a logistic regression: doors of simulated
WEIGHTS = (8.1, -2.7, 4.3)  # worlds, against furniture and glass of three recorded buildings


class Evidence(NamedTuple):
    """What tells a door from furniture that moved, and from glass.

    walls  share of the length beside the gap, to both sides, on which the wall goes on in its line
    flat   deviation of the leaf's echoes from a line, by FLAT, at most 3
    went   share of the cells that changed whose content was seen to go, from one side
    """

    walls: float
    flat: float
    went: float


def probability(evidence: Evidence) -> float:
    """The probability that it is a door."""
    nats = BIAS + sum(w * e for w, e in zip(WEIGHTS, evidence, strict=True))
    return 1.0 / (1.0 + math.exp(-nats))


def walls_beside(ends: Array, kind: np.ndarray, spec: GridSpec) -> float:
    """Share of the lengths beyond both ends (2, 2), m, of a gap, at which a static cell, or a
    neighbour of one, lies in its line."""
    line = (ends[1] - ends[0]) / np.hypot(*(ends[1] - ends[0]))
    away = np.arange(WALL_FROM, WALL_TO, spec.resolution)[:, None] * line
    cells = spec.cells(np.concatenate([ends[0] - away, ends[1] + away]))
    row0, col0 = np.maximum(cells.min(axis=0) - BESIDE_LINE, 0)
    row1, col1 = cells.max(axis=0) + BESIDE_LINE + 1
    static = kind[row0:row1, col0:col1] == STATIC
    near = np.asarray(binary_dilation(static, EIGHT_NEIGHBOURS, BESIDE_LINE), np.bool_)
    rows, cols = (cells - (row0, col0)).T
    inside = (rows >= 0) & (cols >= 0) & (rows < len(near)) & (cols < near.shape[-1])
    return float(near[rows[inside], cols[inside]].sum() / len(cells))


def flatness(across: Array, echoes: np.ndarray) -> float:
    """Deviation of a leaf's echoes from its line, by FLAT, at most 3; cells (n,) lie `across`."""
    return min(math.sqrt(np.average(across**2, weights=echoes)) / FLAT, 3.0)
