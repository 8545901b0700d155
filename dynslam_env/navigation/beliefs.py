"""Beliefs: what a robot that patrols knows of every place, and since when."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from slam.grid import GridSpec


class Beliefs(NamedTuple):
    """The dynamic map of the task, as it stands now.

    spec      its cells, 0.15 m
    occupied  (rows, cols) float32, P(occupied now), predicted: what changes and is not looked at
              goes back to the share of time that it is occupied
    observed  (rows, cols) bool
    age       (rows, cols) float32, s since the cell was last seen; inf where it never was
    flips     (rows, cols) float32, changes seen for every second of watching; 0 where none was
    """

    spec: GridSpec
    occupied: np.ndarray
    observed: np.ndarray
    age: np.ndarray
    flips: np.ndarray
