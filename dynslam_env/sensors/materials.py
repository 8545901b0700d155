"""The materials of a world's walls: panels that are ordinary, dark, or of glass."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dynslam_env.sensors.effects import Surfaces
from slam.errors import InputError
from slam.geometry import Array

Rows = NDArray[np.int64]
Codes = NDArray[np.int8]
ORDINARY, DARK, GLASS = 0, 1, 2


class Panels(NamedTuple):
    """The walls of a world, divided into panels.

    segments  (p, 4) x1, y1, x2, y2, m; those of glass are the last ones
    codes     (p,) ORDINARY, DARK or GLASS
    """

    segments: Array
    codes: Codes

    @property
    def opaque(self) -> int:
        """Number of panels that are not of glass; they come first."""
        return int((self.codes != GLASS).sum())


def panels_of(walls: Array, surfaces: Surfaces | None, rng: np.random.Generator) -> Panels:
    """Divide the walls (w, 4), m, into panels and draw their materials.

    Raises InputError for an index of a wall that is not there.
    """
    if surfaces is None:
        return Panels(walls.copy(), np.zeros(len(walls), dtype=np.int8))
    counts = np.ceil(np.hypot(*(walls[:, 2:] - walls[:, :2]).T) / surfaces.panel).astype(np.int64)
    wall_of = np.repeat(np.arange(len(walls), dtype=np.int64), counts)
    place = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
    starts, along = walls[wall_of, :2], (walls[:, 2:] - walls[:, :2])[wall_of]
    low, high = place / counts[wall_of], (place + 1) / counts[wall_of]
    segments = np.hstack([starts + low[:, None] * along, starts + high[:, None] * along])
    codes = _drawn(surfaces, wall_of, len(walls), rng)
    order = np.argsort(codes == GLASS, kind="stable")
    return Panels(segments[order], codes[order])


def _drawn(surfaces: Surfaces, wall_of: Rows, walls: int, rng: np.random.Generator) -> Codes:
    """(p,) the materials of the panels."""
    number = rng.random(len(wall_of))
    glass = _chosen(surfaces.glass, wall_of, walls, number)
    low = 0.0 if isinstance(surfaces.glass, tuple) else surfaces.glass
    dark = _chosen(surfaces.dark, wall_of, walls, number - low) & ~glass
    return np.select([glass, dark], [GLASS, DARK], ORDINARY).astype(np.int8)


def _chosen(
    which: float | tuple[int, ...], wall_of: Rows, walls: int, number: Array
) -> NDArray[np.bool_]:
    """(p,) the panels of the walls that are named, or a share of all."""
    if not isinstance(which, tuple):
        return number < which
    wrong = [index for index in which if index >= walls]
    if wrong:
        raise InputError(f"Surfaces names wall {wrong[0]}, and the layout has {walls} walls")
    return np.isin(wall_of, which)
