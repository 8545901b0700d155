"""Layers of a map: static, changing, free, kept and unknown cells, and doors, from all scans."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from slam.errors import InputError
from slam.geometry import Array
from slam.grid import GridSpec, OccupancyGrid
from slam.layers.cell_statistics import CellStatistics, observe, session_times
from slam.layers.classification import (
    CHANGING,
    FREE,
    KEPT,
    KEPT_REASONS,
    MIN_HITS,
    STATIC,
    UNKNOWN,
    classify,
    keep,
    remove_flicker,
)
from slam.layers.door_looks import Views
from slam.layers.doors import MappedDoor, find_doors, in_closed_leaves
from slam.layers.glass import panes
from slam.layers.open_leaves import open_swings
from slam.layers.sides import went_away
from slam.layers.surface import SurfaceCells, extent, find_surface
from slam.maps.rays import Rays
from slam.scan import Scan
from slam.validation import finite, positive_number


@dataclass(frozen=True)
class Layers:
    """The class of every cell, and the doors.

    spec      the grid
    kind      (rows, cols) uint8: UNKNOWN, FREE, STATIC, CHANGING or KEPT
    reason    (rows, cols) uint8: why a cell that is not static is kept (SEEN_ONCE, SEEN_IN_PART,
              GLASS), or why it is left out though something stood there for some time, or the
              SLAM's map holds it to be occupied (WENT_AWAY, DOOR_LEAF); NO_REASON elsewhere
    occupied  (rows, cols) float32, share of its watched time in which a cell was occupied; NaN if
              it was not watched
    rate      (rows, cols) float32, changes of state per watched hour
    watched   (rows, cols) float32, s; 0 for cells without an echo
    doors     by decreasing probability, from PERHAPS on
    """

    spec: GridSpec
    kind: np.ndarray
    reason: np.ndarray
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
    def kept(self) -> np.ndarray:
        """(rows, cols) bool: not seen to go, though seen once, or by some beams only: what is thin,
        or of glass."""
        return self.kind == KEPT

    @property
    def free(self) -> np.ndarray:
        """(rows, cols) bool: always free."""
        return self.kind == FREE

    @property
    def unknown(self) -> np.ndarray:
        """(rows, cols) bool: never observed."""
        return self.kind == UNKNOWN

    def static_map(self, keep: Collection[int] = KEPT_REASONS) -> OccupancyGrid:
        """What stands as a map: h is 1 in static cells and in those of the reasons `keep`, 0 in
        other cells that were seen, 0.5 in unknown ones."""
        stands = self.static | np.isin(self.reason, list(keep))
        occupied = np.select([stands, self.unknown], [1.0, 0.5], 0.0)
        return OccupancyGrid(self.spec, occupied, ~self.unknown)


def layers(
    scans: Sequence[Scan],
    poses: Array,
    resolution: float = 0.05,
    rays: Rays = Rays(),
    believed: OccupancyGrid | None = None,
    known_doors: Sequence[MappedDoor] | None = None,
) -> Layers:
    """The layers of all `scans`, in the order of time, at their final `poses` (n, 3).

    resolution  m, side of a cell
    believed    the SLAM's map: what is occupied there is left out only if it was seen to go; None:
                that is held to be occupied which more scans hit than passed. What no beam passed
                stands, whatever the map says
    known_doors the doors, if they are known, as from layers in cells of 5 cm, in which they are
                found best; None: they are looked for

    Errors: InputError unless there is one pose per scan, and if the grid would be too large.
    """
    positive_number("resolution", resolution)
    finite("poses", poses, 3)
    if not len(scans) or len(scans) != len(poses):
        raise InputError(f"layers need one pose a scan, got {len(poses)} for {len(scans)} scans")
    spec = extent(scans, poses, rays, resolution)
    surface = find_surface(scans, poses, rays, spec)
    statistics, passed = observe(scans, poses, rays, spec, surface)
    occupied = _believed(believed, spec, surface, statistics)
    pane = panes(statistics.incidence, surface, spec)
    went = went_away(statistics.sides) & ~pane
    kind = classify(surface, statistics, passed, pane)
    gone, glass = (_raster(values, spec, surface, False) for values in (went, pane))
    views = Views(scans, poses, rays, session_times(scans))
    found = known_doors is None
    doors = find_doors(views, kind, gone, spec, surface) if found else list(known_doors)
    remove_flicker(kind, surface.number, statistics)
    in_part = kind[tuple(surface.cells.T)] == CHANGING
    in_part &= ~went & ~in_closed_leaves(surface.places, doors)
    kind[tuple(surface.cells[in_part].T)] = FREE
    hinged = open_swings(kind, spec, doors)
    doors = hinged if found else doors
    once = _raster(statistics.hits < MIN_HITS, spec, surface, True)
    reason = keep(kind, glass, occupied, gone, once)
    return Layers(spec, kind, reason, *_times(spec, surface, statistics), tuple(doors))


def _believed(
    grid: OccupancyGrid | None, spec: GridSpec, surface: SurfaceCells, statistics: CellStatistics
) -> np.ndarray:
    """(rows, cols) bool: hit and never passed, or occupied in a map; if there is none, hit more
    often than passed."""
    if grid is None:
        return _raster(statistics.hits > statistics.passes, spec, surface, False)
    never_passed = (statistics.hits > 0) & (statistics.passes == 0)
    result = _raster(never_passed, spec, surface, False)
    cells = np.argwhere(grid.solid)
    rows, cols = spec.cells(grid.spec.centres(cells)).T
    inside = (rows >= 0) & (cols >= 0) & (rows < spec.rows) & (cols < spec.cols)
    result[rows[inside], cols[inside]] = True
    return result


def _raster(values: np.ndarray, spec: GridSpec, surface: SurfaceCells, blank: bool) -> np.ndarray:
    """(rows, cols) bool: values (n,) of the surface cells, `blank` elsewhere."""
    result = np.full(spec.shape, blank)
    result[tuple(surface.cells.T)] = values
    return result


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
