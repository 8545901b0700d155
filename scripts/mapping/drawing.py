"""How the maps that `dynslam map` writes are drawn: cells, what stands, and what is masked."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from slam.benchmark.run import Run
from slam.errors import InputError
from slam.grid import OccupancyGrid
from slam.io.ros_map import read_ros_map
from slam.layers import Layers, layers
from slam.layers.classification import (
    DOOR_LEAF,
    GLASS,
    KEPT_REASONS,
    SEEN_IN_PART,
    SEEN_ONCE,
    WENT_AWAY,
)
from slam.layers.masking import MASKED, map_without_masked, without_masked
from slam.layers.union import united
from slam.sessions.redrawing import redrawn
from slam.sessions.session import Session
from slam.validation import positive_number

from ..console.selection import parse_selection
from .lasers import Lasers
from .map_size import check_resolution, check_size

CELL = 0.05  # m, of the cells in which scans are matched and doors are found
KEPT = {
    "once": SEEN_ONCE, "part": SEEN_IN_PART, "glass": GLASS, "gone": WENT_AWAY, "leaf": DOOR_LEAF
}  # fmt: skip
NONE = "none"


@dataclass(frozen=True)
class Drawing:
    """How maps are drawn.

    resolution    m, side of a cell
    keep          reasons (`slam.layers.classification`) of the cells that count as standing beside
                  those that always stood
    mask          areas that are cleared; None: none
    robot_radius  m, that routes keep from what stands
    """

    resolution: float = CELL
    keep: tuple[int, ...] = KEPT_REASONS
    mask: OccupancyGrid | None = None
    robot_radius: float = 0.3

    def believed(self, run: Run, session: Session, variant: str) -> Run:
        """The run with its map in cells of the resolution. Raises InputError if it would be too
        large."""
        if self.resolution == CELL:
            return run
        check_size(session.scans, session.poses, self.resolution)
        return replace(run, grid=redrawn(session, variant, self.resolution))

    def cleared(self, grid: OccupancyGrid) -> OccupancyGrid:
        """A map without what lies in the mask."""
        return grid if self.mask is None else map_without_masked(grid, self.mask)

    def layers(
        self, session: Session, believed: OccupancyGrid, lasers: Lasers, variant: str
    ) -> Layers:
        """The layers as they are written: each laser's of its own scans, and of these one. Raises
        InputError if they would be too large."""
        if self.resolution != CELL:
            check_size(session.scans, session.poses, self.resolution)
        parts = lasers.of(session)
        if len(parts) > 1:
            made = united([self._of_laser(part, variant) for part in parts])
        else:
            made = self._layers(session, believed)
        return made if self.mask is None else without_masked(made, self.mask)

    def _of_laser(self, session: Session, variant: str) -> Layers:
        return self._layers(session, redrawn(session, variant, self.resolution))

    def _layers(self, session: Session, believed: OccupancyGrid) -> Layers:
        """The layers of one laser; doors are found in cells of CELL."""
        scans, poses, doors = session.scans, session.poses, None
        if self.resolution != CELL:
            doors = layers(scans, poses, CELL).doors
        return layers(scans, poses, self.resolution, believed=believed, known_doors=doors)

    def standing(self, made: Layers) -> OccupancyGrid:
        """What stands, of layers."""
        return made.static_map(self.keep)


USUAL = Drawing()


def parsed_drawing(resolution: float, keep: str, mask: Path | None, robot_radius: float) -> Drawing:
    """The drawing that the options --resolution, --keep, --mask and --robot-radius name. Raises
    InputError."""
    check_resolution(resolution)
    positive_number("--robot-radius", robot_radius)
    areas = None if mask is None else read_mask(mask)
    return Drawing(resolution, _kept(keep), areas, robot_radius)


def read_mask(path: Path) -> OccupancyGrid:
    """A mask in the frame of the map. Raises InputError if it cannot be read, or masks nothing."""
    grid = read_ros_map(path)
    if not (grid.observed & (grid.occupied >= MASKED)).any():
        raise InputError(f"{path}: no cell of this mask is black: it would clear nothing")
    return grid


def missed(mask: OccupancyGrid, grid: OccupancyGrid) -> bool:
    """Whether no masked cell lies on one of the map that was observed."""
    cells = np.argwhere(mask.observed & (mask.occupied >= MASKED))
    return not grid.sample(mask.spec.centres(cells))[1].any()


def _kept(text: str) -> tuple[int, ...]:
    if text.strip() == NONE:
        return ()
    named = parse_selection("kind of thing", text, list(KEPT), "dynslam map --help", ("all", NONE))
    return tuple(KEPT[name] for name in named)
