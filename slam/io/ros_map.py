"""Maps for ROS: a PGM picture and a YAML beside it, by the convention of nav2's map_server.

Black (0) is occupied, 254 free, 205 unknown; the first row of the picture is the largest y.
`free_thresh` is 0.196, or unknown (205, that is p = 0.19608) would come back as free.
"""

from __future__ import annotations

import math
import os
import re
from pathlib import Path

import numpy as np

from slam.bounds import MAX_COORDINATE, all_within
from slam.errors import InputError
from slam.geometry import Pose2
from slam.grid import GridSpec, OccupancyGrid
from slam.io.files import AnyPath, reading, replacing, text_lines
from slam.io.guard import guarded, take
from slam.io.one_line import one_line

OCCUPIED, FREE, UNKNOWN = 0, 254, 205
MAX_HEADER = 1 << 16  # bytes, comments and all
MAX_PIXELS = 1 << 28  # pixels
PIXEL_BYTES = 40  # of a pixel: as floats, its probability, and what it is compared with
MIN_CELL, MAX_CELL = 1e-4, 1e4  # m, sides of a cell
HEADER = re.compile(
    rb"P5(?:\s|#[^\n]*\n)+(\d{1,9})(?:\s|#[^\n]*\n)+(\d{1,9})(?:\s|#[^\n]*\n)+(\d{1,5})\s"
)


def write_ros_map(grid: OccupancyGrid, path: AnyPath) -> None:
    """Write `path` with the ending .pgm and, last, with .yaml.

    Occupied is an observed cell with h > 0.5, free one with h < 0.5; all else is unknown.
    """
    path = Path(path)
    picture = np.full(grid.spec.shape, UNKNOWN, dtype=np.uint8)
    picture[grid.observed & (grid.occupied > 0.5)] = OCCUPIED
    picture[grid.observed & (grid.occupied < 0.5)] = FREE
    with replacing(path.with_suffix(".pgm")) as file:
        file.write(f"P5\n{grid.spec.cols} {grid.spec.rows}\n255\n".encode())
        file.write(picture[::-1].tobytes())
    x, y = grid.spec.origin
    with replacing(path.with_suffix(".yaml")) as file:
        file.write(
            f"image: {path.with_suffix('.pgm').name}\n"
            "mode: trinary\n"
            f"resolution: {grid.spec.resolution!r}\n"
            f"origin: [{x!r}, {y!r}, 0.0]\n"
            "negate: 0\n"
            "occupied_thresh: 0.65\n"
            "free_thresh: 0.196\n".encode()
        )


def read_ros_map(path: AnyPath) -> OccupancyGrid:
    """Read a trinary map by its YAML: h is 1 occupied, 0 free, 0.5 unknown. Raises InputError.

    An origin off our lattice is moved to the nearest point of it, by half a cell at most;
    `read_placed_map` says by how much.
    """
    return read_placed_map(path)[0]


def read_placed_map(path: AnyPath) -> tuple[OccupancyGrid, Pose2]:
    """The map as of `read_ros_map`, and the pose of the grid's frame in that of the map."""
    with guarded(path):
        return _read(Path(path))


def _read(path: Path) -> tuple[OccupancyGrid, Pose2]:
    fields = _fields(path)
    mode = fields.get("mode", "trinary")
    if mode != "trinary":
        raise InputError(f"{path}: mode {one_line(mode, 60)!r} is not read, expected trinary")
    resolution = _number(path, fields, "resolution")
    if not MIN_CELL <= resolution <= MAX_CELL:
        raise InputError(
            f"{path}: expected a `resolution` from {MIN_CELL:g} to {MAX_CELL:g} m, got {resolution}"
        )
    x, y = _origin(path, fields)
    picture = _read_pgm(path.parent / _text(path, fields, "image"))[::-1].astype(np.float64)
    p = picture / 255 if _number(path, fields, "negate", 0.0) else (255 - picture) / 255
    occupied = p > _number(path, fields, "occupied_thresh")
    free = p < _number(path, fields, "free_thresh")
    spec = GridSpec(resolution, round(y / resolution), round(x / resolution), *picture.shape)
    grid = OccupancyGrid(spec, np.select([occupied, free], [1.0, 0.0], 0.5), occupied | free)
    return grid, Pose2(x - spec.origin[0], y - spec.origin[1], 0.0)


def _fields(path: Path) -> dict[str, str]:
    """The `key: value` lines of a flat YAML; nothing else of YAML is needed here."""
    fields: dict[str, str] = {}
    for number, text in text_lines(path):
        if text == "---":
            continue
        key, colon, value = text.partition(":")
        value = re.sub(r"(^|\s)#.*", "", value).strip()
        if not colon or not value or not re.fullmatch(r"\w+", key):
            raise InputError(f"{path}:{number}: expected `key: value`, got {text[:60]!r}")
        fields[key] = value.strip("\"'")
    return fields


def _text(path: Path, fields: dict[str, str], key: str) -> str:
    if key not in fields:
        raise InputError(f"{path}: expected a line `{key}: ...`, there is none")
    return fields[key]


def _number(path: Path, fields: dict[str, str], key: str, default: float | None = None) -> float:
    if key not in fields and default is not None:
        return default
    return _finite(path, key, _text(path, fields, key))


def _finite(path: Path, key: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(f"{path}: expected a number for `{key}`, got {text[:60]!r}")
    return value


def _origin(path: Path, fields: dict[str, str]) -> tuple[float, float]:
    text = _text(path, fields, "origin")
    values = [_finite(path, "origin", part) for part in text.strip("[]").split(",")]
    if len(values) != 3 or not all_within(values, MAX_COORDINATE):
        raise InputError(f"{path}: expected `origin: [x, y, yaw]`, got {text[:60]!r}")
    if values[2]:
        raise InputError(f"{path}: expected an origin that is not turned, got yaw {values[2]}")
    return values[0], values[1]


def _read_pgm(path: Path) -> np.ndarray:
    with reading(path) as file:
        header = HEADER.match(file.read(MAX_HEADER))
        if not header or header[3] != b"255":
            raise InputError(f"{path}: expected a binary PGM (P5) with 8 bits a pixel")
        cols, rows = int(header[1]), int(header[2])
        held = file.seek(0, os.SEEK_END) - header.end()
        if not rows * cols or held != rows * cols:
            raise InputError(f"{path}: expected {cols} x {rows} pixels, got {held} bytes of them")
        if held > MAX_PIXELS:
            raise InputError(f"{path}: {cols} x {rows} pixels are more than any map has")
        take(PIXEL_BYTES * held)
        file.seek(header.end())
        return np.frombuffer(file.read(), dtype=np.uint8).reshape(rows, cols)
