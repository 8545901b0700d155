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
WALL_THICKNESS = 0.25  # m, at most between the two faces of a wall, which are of one material
LATTICE_MARGIN = 1e-6  # of a panel: a shorter piece is none


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
    wall_of, segments, places = _divided(walls, surfaces.panel)
    codes = _drawn(surfaces, wall_of, len(walls), rng.random(places.max(initial=-1) + 1)[places])
    order = np.argsort(codes == GLASS, kind="stable")
    return Panels(segments[order], codes[order])


def _divided(walls: Array, panel: float) -> tuple[Rows, Array, Rows]:
    """(p,) walls, (p, 4) segments and (p,) places of the panels.

    The borders of panels are at whole multiples of `panel` along their direction, so that the two
    faces of a wall are divided alike: they are one place.
    """
    ends = walls[:, 2:] - walls[:, :2]
    direction = np.rint(np.degrees(np.arctan2(ends[:, 1], ends[:, 0]))).astype(np.int64) % 180
    along = np.column_stack([np.cos(np.radians(direction)), np.sin(np.radians(direction))])
    begin, end = (walls[:, :2] * along).sum(axis=1), (walls[:, 2:] * along).sum(axis=1)
    first = np.floor(np.minimum(begin, end) / panel + LATTICE_MARGIN).astype(np.int64)
    last = np.ceil(np.maximum(begin, end) / panel - LATTICE_MARGIN).astype(np.int64)
    counts = np.maximum(last - first, 1)
    which = np.repeat(np.arange(len(walls), dtype=np.int64), counts)
    index = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts) + first[which]
    borders = np.column_stack([index, index + 1]) * panel
    borders[index == first[which], 0] = -np.inf
    borders[index == first[which] + counts[which] - 1, 1] = np.inf
    shares = (borders - begin[which, None]) / (end - begin)[which, None]
    shares = np.sort(np.clip(shares, 0.0, 1.0), axis=1)
    low, high = (walls[which, :2] + shares[:, [k]] * ends[which] for k in range(2))
    across = np.column_stack([-along[:, 1], along[:, 0]])[which]
    offset = ((low + high) / 2 * across).sum(axis=1)
    return which, np.hstack([low, high]), _places(direction[which], index, offset)


def _places(direction: Rows, index: Rows, offset: Array) -> Rows:
    """(p,) numbers of the places: panels side by side at most WALL_THICKNESS apart are one."""
    order = np.lexsort([offset, index, direction])
    rows = np.column_stack([direction, index])[order]
    new = (np.diff(rows, axis=0) != 0).any(axis=1) | (np.diff(offset[order]) > WALL_THICKNESS)
    places = np.empty(len(order), dtype=np.int64)
    places[order] = np.concatenate([[0], np.cumsum(new)])[: len(order)]
    return places


def _drawn(surfaces: Surfaces, wall_of: Rows, walls: int, number: Array) -> Codes:
    """(p,) the materials of the panels, by uniform random numbers (p,)."""
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
