"""What the map of a SLAM holds in memory."""

from __future__ import annotations

from typing import NamedTuple

from slam.interface import MapModel, Slam
from slam.maps.tiles import AREA


class MapMemory(NamedTuple):
    """The memory of a map, with all layers that a reading of it keeps beside.

    nbytes    of the tiles in use, and of what the map model keeps outside of them
    observed  cells that anything was seen of
    cells     of the tiles in use
    """

    nbytes: int
    observed: int
    cells: int


def map_of(robot: Slam) -> MapModel | None:
    """The map model of a SLAM that has one to show."""
    grid = getattr(robot, "map_model", None)
    return grid if hasattr(grid, "cells") else None


def map_memory(grid: MapModel) -> MapMemory:
    """What `grid` holds now."""
    tiles = grid.cells.tiles
    in_use = tiles.references > 0
    observed = int(grid.cells.observed.values[in_use].sum())
    cells = (int(in_use.sum()) - 1) * AREA
    return MapMemory(getattr(grid, "nbytes", tiles.nbytes), observed, cells)
