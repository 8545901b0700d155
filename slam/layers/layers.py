"""Layers of the map: what always stands, what changes, what is free, what nobody has seen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slam.errors import InputError
from slam.geometry import Array
from slam.grid import GridSpec, OccupancyGrid
from slam.layers.doors import MappedDoor, find_doors, open_swings
from slam.layers.kinds import CHANGING, FREE, STATIC, UNKNOWN, kinds, settle
from slam.layers.looks import Looks, look
from slam.layers.surface import SurfaceCells, extent, find_surface
from slam.maps.rays import Rays
from slam.scan import Scan
from slam.validation import finite, positive_number


@dataclass(frozen=True)
class Layers:
    """One cell, one kind.

    spec      the grid
    kind      (rows, cols) uint8: UNKNOWN, FREE, STATIC or CHANGING
    occupied  (rows, cols) float32, share of its watched time in which a cell was occupied; NaN
              where nothing was watched or no echo ever came from
    rate      (rows, cols) float32, changes of state for every hour watched
    watched   (rows, cols) float32, s; what no echo ever came from counts as not watched
    doors     those found
    """

    spec: GridSpec
    kind: np.ndarray
    occupied: np.ndarray
    rate: np.ndarray
    watched: np.ndarray
    doors: tuple[MappedDoor, ...]

    @property
    def static(self) -> np.ndarray:
        """(rows, cols) bool: always stands."""
        return self.kind == STATIC

    @property
    def changing(self) -> np.ndarray:
        """(rows, cols) bool: now this, now that."""
        return self.kind == CHANGING

    @property
    def free(self) -> np.ndarray:
        """(rows, cols) bool: always free."""
        return self.kind == FREE

    @property
    def unknown(self) -> np.ndarray:
        """(rows, cols) bool: never seen."""
        return self.kind == UNKNOWN

    def static_map(self) -> OccupancyGrid:
        """What always stands, as a map: h is 1; what is free now and then is free, h is 0."""
        occupied = np.select([self.static, self.unknown], [1.0, 0.5], 0.0)
        return OccupancyGrid(self.spec, occupied, ~self.unknown)


def layers(
    scans: Sequence[Scan], poses: Array, resolution: float = 0.05, rays: Rays = Rays()
) -> Layers:
    """Layers of all `scans`, in the order of time, at their final `poses` (n, 3).

    resolution  m, side of a cell
    Raises InputError for poses that are not one a scan, and for a place larger than a grid.
    """
    positive_number("resolution", resolution)
    finite("poses", poses, 3)
    if not len(scans) or len(scans) != len(poses):
        raise InputError(f"layers need one pose a scan, got {len(poses)} for {len(scans)} scans")
    spec = extent(scans, poses, rays, resolution)
    surface = find_surface(scans, poses, rays, spec)
    looks, passed = look(scans, poses, rays, spec, surface)
    kind = kinds(surface, looks, passed)
    doors = find_doors(kind, spec, surface, looks)
    settle(kind, surface.number, looks)
    open_swings(kind, spec, doors)
    return Layers(spec, kind, *_times(spec, surface, looks), tuple(doors))


def _times(
    spec: GridSpec, surface: SurfaceCells, looks: Looks
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Share of time occupied, flips for every hour, s watched."""
    watched = looks.free_for + looks.occupied_for
    with np.errstate(invalid="ignore", divide="ignore"):
        share = looks.occupied_for / watched
        rate = np.where(watched > 0, 3600.0 * looks.flips / watched, 0.0)
    rasters = []
    for values, blank in ((share, np.nan), (rate, 0.0), (watched, 0.0)):
        raster = np.full(spec.shape, blank, np.float32)
        raster[tuple(surface.cells.T)] = values
        rasters.append(raster)
    return rasters[0], rasters[1], rasters[2]
