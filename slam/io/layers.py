"""Layers as files: a picture, the doors as GeoJSON, and all of them as .npz.

Coordinates of GeoJSON are degrees of longitude and latitude (RFC 7946, section 4). Those of a
robot's map are metres in its frame, as the foreign member `frame` says in every file.
"""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from slam.grid import MOST_CELLS, GridSpec
from slam.io.arrays import parsed
from slam.io.files import AnyPath, replacing
from slam.layers import Layers
from slam.layers.classification import CHANGING, FREE, STATIC, UNKNOWN
from slam.layers.doors import MappedDoor

FORMAT = "dynslam-layers-1"
WHAT = "layers written by dynslam"
FRAME = "map, x and y in metres: not the longitude and latitude of RFC 7946"
STATIC_COLOUR, FREE_COLOUR, UNKNOWN_COLOUR = (0, 0, 0), (255, 255, 255), (205, 205, 205)
SELDOM_COLOUR, MOSTLY_COLOUR = (255, 214, 102), (192, 20, 60)  # of changing cells


def write_picture(layers: Layers, path: AnyPath) -> None:
    """Write a PNG, a pixel a cell, the largest y on top.

    Black is static, white free, grey unknown; cells that change go from yellow, seldom occupied, to
    red, mostly occupied.
    """
    from PIL import Image

    with replacing(path) as file:
        Image.fromarray(picture(layers)[::-1]).save(file, format="PNG")


def picture(layers: Layers) -> np.ndarray:
    """(rows, cols, 3) uint8: the colours of the cells, in the order of the grid."""
    colours = np.empty((4, 3), np.uint8)
    colours[[UNKNOWN, FREE, STATIC, CHANGING]] = (
        UNKNOWN_COLOUR,
        FREE_COLOUR,
        STATIC_COLOUR,
        MOSTLY_COLOUR,
    )
    pixels = colours[layers.kind]
    share = np.nan_to_num(layers.occupied[layers.changing], nan=1.0)[:, None]
    pixels[layers.changing] = np.round(
        share * MOSTLY_COLOUR + (1 - share) * np.array(SELDOM_COLOUR)
    )
    return pixels


def write_doors(layers: Layers, path: AnyPath) -> None:
    """Write the doors found as a GeoJSON FeatureCollection of polygons, the most certain first."""
    features = [_feature(number, door) for number, door in enumerate(layers.doors, 1)]
    collection = {"type": "FeatureCollection", "frame": FRAME, "features": features}
    with replacing(path) as file:
        file.write(json.dumps(collection, indent=1, allow_nan=False).encode() + b"\n")


def _feature(number: int, door: MappedDoor) -> dict[str, Any]:
    corners = np.round(door.outline, 3).tolist()
    return {
        "type": "Feature",
        "id": number,
        "geometry": {"type": "Polygon", "coordinates": [[*corners, corners[0]]]},
        "properties": {
            "kind": "door",
            "width_m": round(door.width, 3),
            "open_share": round(door.open_share, 3),
            "flips": door.flips,
            "flips_per_hour": round(door.per_hour, 1),
            "watched_s": round(door.watched, 1),
            "first_seen_s": round(door.first, 1),
            "last_seen_s": round(door.last, 1),
            "confidence": round(door.confidence, 3),
        },
    }


def write_layers(layers: Layers, path: AnyPath) -> None:
    """Write all layers to `path` (.npz)."""
    spec = layers.spec
    doors = [(*door.ends.ravel(), *door[1:]) for door in layers.doors]
    with replacing(path) as file:
        np.savez_compressed(
            file,
            format=FORMAT,
            resolution=spec.resolution,
            corner=np.array((spec.row0, spec.col0)),
            kind=layers.kind,
            occupied=layers.occupied,
            rate=layers.rate,
            watched=layers.watched,
            doors=np.array(doors, dtype=np.float64).reshape(-1, 10),
        )


def read_layers(path: AnyPath) -> Layers:
    """Read what `write_layers` wrote. Raises InputError for anything else; never runs a pickle."""
    return parsed(path, WHAT, FORMAT, _layers)


def _layers(data: dict[str, np.ndarray]) -> Layers:
    kind, resolution = data["kind"], float(data["resolution"])
    row0, col0 = data["corner"].tolist()
    rasters = [data[name] for name in ("occupied", "rate", "watched")]
    if kind.ndim != 2 or kind.size > MOST_CELLS or any(r.shape != kind.shape for r in rasters):
        raise ValueError(f"layers of shapes {[r.shape for r in (kind, *rasters)]}")
    if kind.dtype != np.uint8 or (kind > CHANGING).any() or not 0 < resolution < np.inf:
        raise ValueError("kinds of cells, or a resolution, that there are not")
    doors = [
        MappedDoor(np.array(row[:4]).reshape(2, 2), row[4], int(row[5]), *row[6:])
        for row in data["doors"].tolist()
    ]
    spec = GridSpec(resolution, row0, col0, *kind.shape)
    return Layers(spec, kind, rasters[0], rasters[1], rasters[2], tuple(doors))
