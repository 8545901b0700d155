"""Beliefs: the dynamic map of a patrol as arrays."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from slam.grid import GridSpec


class Beliefs(NamedTuple):
    """The task's dynamic map, predicted for one moment.

    spec      grid of its cells, 0.15 m
    occupied  (rows, cols) float32, P(occupied now), predicted: a cell that changes and is not seen
              relaxes towards its stationary probability
    observed  (rows, cols) bool
    age       (rows, cols) float32, s since the cell was last seen; inf if never seen
    flips     (rows, cols) float32, observed changes per second of observation; 0 without any
    """

    spec: GridSpec
    occupied: np.ndarray
    observed: np.ndarray
    age: np.ndarray
    flips: np.ndarray
