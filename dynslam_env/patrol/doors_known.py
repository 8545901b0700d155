"""How well the dynamic map knows which doors are closed now: for the judge, who knows the truth."""

from __future__ import annotations

import numpy as np

from dynslam_env.patrol.memory import CELL, DynamicMap
from dynslam_env.worlds.layout import Door, Layout
from slam.geometry import Array

CLOSED = 0.2  # rad: a door that is open no wider counts as closed
ALONG = np.linspace(0.15, 0.85, 8)  # of a closed leaf, where the map is asked
ACROSS = np.array([-1.0, 0.0, 1.0])  # cells beside it: a pose that is a little off is no mistake
UNKNOWN = 0.5  # what is believed of a door that was never seen


class DoorsKnown:
    """Asks the map about the doors of a layout."""

    def __init__(self, layout: Layout):
        self._points = np.array([_points(door) for door in layout.doors]).reshape(-1, 2)
        self._shape = len(layout.doors), len(ALONG), len(ACROSS)

    def near(self, memory: DynamicMap, time: float) -> Array:
        """(d, ALONG, ACROSS) P(occupied at `time`) along the closed leaves and beside them; NaN
        where nothing was seen."""
        return memory.occupied(self._points, time).reshape(self._shape)

    def brier(self, memory: DynamicMap, time: float, openings: Array) -> float:
        """See the function."""
        return float(brier(self.near(memory, time), openings))


def closed(near: Array) -> Array:
    """(..., d) P(closed) of doors, from what `DoorsKnown.near` gives of them (..., d, ALONG,
    ACROSS): the mean along the leaf of what is most occupied near it; UNKNOWN where nothing of it
    was seen."""
    along = np.fmax.reduce(near, axis=-1)
    seen = ~np.isnan(along)
    total = np.where(seen, along, 0.0).sum(axis=-1)
    return np.where(seen.any(axis=-1), total / np.maximum(seen.sum(axis=-1), 1), UNKNOWN)


def brier(near: Array, openings: Array) -> Array:
    """(...) mean squared difference of P(closed) and whether the doors, `openings` (..., d) rad,
    are (Brier 1950); NaN without doors."""
    if not openings.shape[-1]:
        return np.full(openings.shape[:-1], np.nan)
    return np.mean((closed(near) - (openings < CLOSED)) ** 2, axis=-1)


def _points(door: Door) -> Array:
    """(ALONG, ACROSS, 2) m, along the middle of the closed leaf, and beside it."""
    along = np.array([np.cos(door.closed), np.sin(door.closed)])
    across = np.array([-along[1], along[0]])
    middle = np.array(door.hinge) - 0.5 * door.swing * door.thickness * across
    steps = (ALONG * door.width)[:, None, None] * along
    return middle + steps + (ACROSS * CELL)[:, None] * across
