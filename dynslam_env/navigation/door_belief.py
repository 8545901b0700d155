"""DoorBelief: what a robot believes of one doorway, now and later, as agents plan with it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from slam.geometry import Array

HORIZONS = np.array([0.0, 5.0, 10.0, 20.0, 40.0, 80.0, 160.0, 320.0])  # s from now
"""The times ahead at which a belief is forecast."""


class DoorBelief(NamedTuple):
    """One suspected doorway, at one moment.

    place   (4,) x, y of its middle, m; direction of the wall, rad; width, m
    closed  P(closed now)
    age     s since it was last seen; inf if never
    leaf    whether its leaf was seen
    stale   (HORIZONS,) expected squared error of P(closed) at each of HORIZONS from now, if the
            door is not looked at: p (1 - p)
    fresh   (HORIZONS,) the same after a look now, expected over what the look shows
    """

    place: Array
    closed: float
    age: float
    leaf: bool
    stale: Array
    fresh: Array


def spread(p: Array) -> Array:
    """Expected squared error of probabilities that are right: p (1 - p)."""
    return p * (1.0 - p)
