"""Layers of a map: static, changing, free and unknown cells, and doors, from all scans."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from slam.errors import InputError
from slam.geometry import Array
from slam.grid import GridSpec, OccupancyGrid
from slam.layers.cell_statistics import CellStatistics, observe
from slam.layers.classification import (
    CHANGING,
    FREE,
    STATIC,
    UNKNOWN,
    classify,
    remove_flicker,
)
from slam.layers.doors import MappedDoor, find_doors, open_swings
from slam.layers.surface import SurfaceCells, extent, find_surface
from slam.maps.rays import Rays
from slam.scan import Scan
from slam.validation import finite, positive_number


@dataclass(frozen=True)
class Layers:
    """The class of every cell, and the doors.

    spec      the grid
    kind      (rows, cols) uint8: UNKNOWN, FREE, STATIC or CHANGING
    occupied  (rows, cols) float32, share of its watched time in which a cell was occupied; NaN if
              it was not watched
    rate      (rows, cols) float32, changes of state per watched hour
    watched   (rows, cols) float32, s; 0 for cells without an echo
    doors     by decreasing confidence
    """

    spec: GridSpec
    kind: np.ndarray
    occupied: np.ndarray
    rate: np.ndarray
    watched: np.ndarray
    doors: tuple[MappedDoor, ...]

    @property
    def static(self) -> np.ndarray:
        """(rows, cols) bool: always occupied."""
        return self.kind == STATIC

    @property
    def changing(self) -> np.ndarray:
        """(rows, cols) bool: sometimes occupied, sometimes free."""
        return self.kind == CHANGING

    @property
    def free(self) -> np.ndarray:
        """(rows, cols) bool: always free."""
        return self.kind == FREE

    @property
    def unknown(self) -> np.ndarray:
        """(rows, cols) bool: never observed."""
        return self.kind == UNKNOWN

    def static_map(self) -> OccupancyGrid:
        """The static cells as a map: h is 1; 0 in free and changing cells, 0.5 in unknown ones."""
        occupied = np.select([self.static, self.unknown], [1.0, 0.5], 0.0)
        return OccupancyGrid(self.spec, occupied, ~self.unknown)


def layers(
    scans: Sequence[Scan], poses: Array, resolution: float = 0.05, rays: Rays = Rays()
) -> Layers:
    """The layers of all `scans`, in the order of time, at their final `poses` (n, 3).

    resolution  m, side of a cell

    Errors: InputError unless there is one pose per scan, and if the grid would be too large.
    """
    positive_number("resolution", resolution)
    finite("poses", poses, 3)
    if not len(scans) or len(scans) != len(poses):
        raise InputError(f"layers need one pose a scan, got {len(poses)} for {len(scans)} scans")
    spec = extent(scans, poses, rays, resolution)
    surface = find_surface(scans, poses, rays, spec)
    statistics, passed = observe(scans, poses, rays, spec, surface)
    kind = classify(surface, statistics, passed)
    doors = find_doors(kind, spec, surface, statistics)
    remove_flicker(kind, surface.number, statistics)
    open_swings(kind, spec, doors)
    return Layers(spec, kind, *_times(spec, surface, statistics), tuple(doors))


def _times(
    spec: GridSpec, surface: SurfaceCells, statistics: CellStatistics
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(rows, cols) each: share of time occupied, flips per watched hour, s watched."""
    watched = statistics.free_for + statistics.occupied_for
    with np.errstate(invalid="ignore", divide="ignore"):
        share = statistics.occupied_for / watched
        rate = np.where(watched > 0, 3600.0 * statistics.flips / watched, 0.0)
    rasters = []
    for values, blank in ((share, np.nan), (rate, 0.0), (watched, 0.0)):
        raster = np.full(spec.shape, blank, np.float32)
        raster[tuple(surface.cells.T)] = values
        rasters.append(raster)
    return rasters[0], rasters[1], rasters[2]
