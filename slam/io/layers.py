"""Layers as files: the doors as GeoJSON, and all of them as .npz; and their colours.

Coordinates of GeoJSON are degrees of longitude and latitude (RFC 7946, section 4). Those of a
robot's map are metres in its frame, as the foreign member `frame` says in every file.
"""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from slam.bounds import MAX_TIME
from slam.grid import MOST_CELLS, GridSpec
from slam.io.arrays import parsed
from slam.io.files import AnyPath, replacing
from slam.io.guard import RECORD_BYTES, take
from slam.layers import Layers
from slam.layers.classification import CHANGING, FREE, GLASS, KEPT, STATIC, UNKNOWN
from slam.layers.doors import MappedDoor

Week = dict[str, Any] | None
FORMAT = "dynslam-layers-3"
WHAT = "layers written by dynslam"
RASTERS = {"occupied": np.nan, "rate": 0.0, "watched": 0.0}  # and their values elsewhere
MOST = {"occupied": 1.0, "rate": MAX_TIME, "watched": MAX_TIME}
FRAME = "map, x and y in metres: not the longitude and latitude of RFC 7946"
COLOURS = {
    "static": (0, 0, 0),
    "kept": (110, 60, 190),
    "free": (255, 255, 255),
    "unknown": (205, 205, 205),
    "seldom": (255, 214, 102),  # occupied, of changing cells
    "mostly": (192, 20, 60),
}


def picture(layers: Layers) -> np.ndarray:
    """(rows, cols, 3) uint8: the COLOURS of the cells, in the order of the grid; cells that change
    go from seldom to mostly occupied."""
    colours = np.empty((KEPT + 1, 3), np.uint8)
    named = {UNKNOWN: "unknown", FREE: "free", STATIC: "static", CHANGING: "mostly", KEPT: "kept"}
    for kind, name in named.items():
        colours[kind] = COLOURS[name]
    pixels = colours[layers.kind]
    share = np.nan_to_num(layers.occupied[layers.changing], nan=1.0)[:, None]
    mixed = share * COLOURS["mostly"] + (1 - share) * np.array(COLOURS["seldom"])
    pixels[layers.changing] = np.round(mixed)
    return pixels


def doors_collection(layers: Layers, weeks: Sequence[Week] = ()) -> dict[str, Any]:
    """The doors found as a GeoJSON FeatureCollection of polygons, the most probable first.

    weeks  of the first doors, what was learned of their habits: `DoorForecast.to_dict`

    `hinge` is the end of the gap at which the open leaf was seen, and `opens_to` the side of it, as
    seen along the polygon's first edge; null if the leaf was not seen open, or slides.
    """
    habits = [*weeks, *([None] * (len(layers.doors) - len(weeks)))]
    listed = zip(layers.doors, habits, strict=True)
    features = [_feature(number, *door) for number, door in enumerate(listed, 1)]
    return {"type": "FeatureCollection", "frame": FRAME, "features": features}


def write_doors(layers: Layers, path: AnyPath, weeks: Sequence[Week] = ()) -> None:
    """Write `doors_collection`."""
    text = json.dumps(doors_collection(layers, weeks), indent=1, allow_nan=False)
    with replacing(path) as file:
        file.write(text.encode() + b"\n")


def _feature(number: int, door: MappedDoor, week: Week) -> dict[str, Any]:
    corners = np.round(door.outline, 3).tolist()
    return {
        "type": "Feature",
        "id": number,
        "geometry": {"type": "Polygon", "coordinates": [[*corners, corners[0]]]},
        "properties": {
            "kind": "door" if door.sure else "perhaps a door",
            "probability": round(door.probability, 3),
            "width_m": round(door.width, 3),
            "open_share": round(door.open_share, 3),
            "open_probability": round(door.open_probability, 3),
            "flips": door.flips,
            "flips_per_hour": round(door.per_hour, 1),
            "watched_s": round(door.watched, 1),
            "first_seen_s": round(door.first, 1),
            "last_seen_s": round(door.last, 1),
            "seen_open_scans": door.seen_open,
            "seen_closed_scans": door.seen_closed,
            "hinge": None if door.hinge < 0 else np.round(door.ends[door.hinge], 3).tolist(),
            "opens_to": {1: "left", -1: "right"}.get(door.swing),
            **({} if week is None else {"week": week}),
        },
    }


def write_layers(layers: Layers, path: AnyPath) -> None:
    """Write all layers to `path` (.npz): of `occupied`, `rate` and `watched` the `watched_cells`,
    numbered row by row; elsewhere they are NaN, 0 and 0."""
    spec, cells = layers.spec, np.flatnonzero(layers.watched > 0)
    with replacing(path) as file:
        np.savez_compressed(
            file,
            format=FORMAT,
            resolution=spec.resolution,
            corner=np.array((spec.row0, spec.col0)),
            kind=layers.kind,
            reason=layers.reason,
            watched_cells=cells,
            **{name: getattr(layers, name).ravel()[cells] for name in RASTERS},
            doors=packed_doors(layers.doors),
        )


def read_layers(path: AnyPath) -> Layers:
    """Read what `write_layers` wrote. Raises InputError for anything else; never runs a pickle."""
    return parsed(path, WHAT, FORMAT, _layers, number_bytes=1)


def _layers(data: dict[str, np.ndarray]) -> Layers:
    kind, reason, resolution = data["kind"], data["reason"], float(data["resolution"])
    row0, col0 = data["corner"][:3].tolist()
    if kind.ndim != 2 or kind.size > MOST_CELLS or reason.shape != kind.shape:
        raise ValueError(f"layers of shapes {kind.shape}, {reason.shape}")
    if kind.dtype != np.uint8 or (kind > KEPT).any() or not 0 < resolution < np.inf:
        raise ValueError("kinds of cells, or a resolution, that there are not")
    if reason.dtype != np.uint8 or (reason > GLASS).any():
        raise ValueError("reasons that there are not")
    take(RECORD_BYTES * len(data["doors"]))
    doors = tuple(unpacked_door(row) for row in data["doors"].tolist())
    spec = GridSpec(resolution, row0, col0, *kind.shape)
    cells = data["watched_cells"]
    if cells.dtype != np.int64 or not (np.diff(cells, prepend=-1, append=kind.size) > 0).all():
        raise ValueError("numbers of cells that are not in order")
    rasters = [_raster(cells, data[name], name, kind.shape) for name in RASTERS]
    return Layers(spec, kind, reason, *rasters, doors=doors)


def _raster(cells: np.ndarray, values: np.ndarray, name: str, shape: tuple[int, ...]) -> np.ndarray:
    if (
        values.dtype != np.float32
        or not (values >= 0.0).all()
        or values.max(initial=0.0) > MOST[name]
    ):
        raise ValueError(f"values of {name} that there are not")
    take(np.dtype(np.float32).itemsize * math.prod(shape))
    result = np.full(shape, RASTERS[name], np.float32)
    result.ravel()[cells] = values
    return result


def packed_doors(doors: Sequence[MappedDoor]) -> np.ndarray:
    """(n, 13) doors as rows of numbers."""
    rows = [(*door.ends.ravel(), *door[1:]) for door in doors]
    return np.array(rows, dtype=np.float64).reshape(-1, 4 + len(MappedDoor._fields) - 1)


def unpacked_door(row: list[float]) -> MappedDoor:
    """The door of a row of the array that is stored."""
    share, flips, watched, first, last, seen_open, seen_closed, probability, hinge, swing = row[4:]
    scans = int(seen_open), int(seen_closed)
    return MappedDoor(np.array(row[:4]).reshape(2, 2), share, int(flips), watched, first, last,
                      *scans, probability, int(hinge), int(swing))  # fmt: skip
