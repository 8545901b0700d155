"""The map of a session drawn anew, in cells of another size."""

from __future__ import annotations

import inspect
from typing import Any

from slam.errors import InputError
from slam.grid import OccupancyGrid
from slam.interface import MapModel
from slam.registry import make
from slam.sessions.session import Session


def map_model_of(variant: str, resolution: float) -> MapModel:
    """An empty map as a SLAM variant has it, with cells of `resolution` (m).

    Its other parameters are the variant's. Raises InputError for a variant without a map, or whose
    map has no `resolution`.
    """
    robot: Any = make(variant)
    model: Any = getattr(robot, "map_model", None)
    if callable(model):  # a graph makes its map when it draws it
        model = model()
    names = inspect.signature(type(model).__init__).parameters
    if "resolution" not in names:
        raise InputError(f"the map of {variant!r} cannot be drawn in cells of another size")
    kept = {name: getattr(model, name) for name in names if hasattr(model, name)}
    return type(model)(**{**kept, "resolution": resolution})


def redrawn(session: Session, variant: str, resolution: float) -> OccupancyGrid:
    """The map of a session's keyframes at their final poses, by the map model of a SLAM variant,
    in cells of `resolution` (m). Raises InputError as `map_model_of`."""
    model = map_model_of(variant, resolution)
    for scan, pose in session.keyframes():
        model.integrate(scan, pose)
    return model.cells.grid()
