"""Maps for ROS: a PGM picture and a YAML beside it, by the convention of nav2's map_server.

Black (0) is occupied, 254 free, 205 unknown; the first row of the picture is the largest y.
`free_thresh` is 0.196, or unknown (205, that is p = 0.19608) would come back as free.
"""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np

from slam.bounds import MAX_COORDINATE, all_within
from slam.errors import InputError
from slam.geometry import Array, Pose2
from slam.grid import GridSpec, OccupancyGrid
from slam.io.files import AnyPath, replacing, text_lines
from slam.io.guard import allow, guarded
from slam.io.one_line import one_line
from slam.io.pictures import read_picture

OCCUPIED, FREE, UNKNOWN = 0, 254, 205
MIN_CELL, MAX_CELL = 1e-4, 1e4  # m, sides of a cell
MODES = "trinary", "scale", "raw"
MOST_PERCENT = 100  # in the mode `raw`; larger numbers are unknown
NO_PERCENT = 255  # written there for unknown


def write_ros_map(grid: OccupancyGrid, path: AnyPath) -> None:
    """Write `path` with the ending .pgm and, last, with .yaml.

    Occupied is an observed cell with h > 0.5, free one with h < 0.5; all else is unknown.
    """
    picture = np.full(grid.spec.shape, UNKNOWN, dtype=np.uint8)
    picture[grid.solid] = OCCUPIED
    picture[grid.observed & (grid.occupied < 0.5)] = FREE
    thresholds = "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    _write(Path(path), grid.spec, picture, "trinary", thresholds)


def write_filter_mask(percent: np.ndarray, spec: GridSpec, path: AnyPath) -> None:
    """Write the mask of one of Nav2's costmap filters, as a map of the mode `raw`: its map server
    publishes each number as it is.

    percent  (rows, cols) 0 to 100: for the keep-out filter 100 is closed and 0 open; for the speed
             filter the limit in percent, and 0 none. Other numbers are unknown: neither filter
             acts there
    """
    numbers = np.asarray(percent)
    picture = np.where((numbers >= 0) & (numbers <= MOST_PERCENT), numbers, NO_PERCENT)
    thresholds = "negate: 0\noccupied_thresh: 1.0\nfree_thresh: 0.0\n"  # required, not used
    _write(Path(path), spec, picture.astype(np.uint8), "raw", thresholds)


def _write(path: Path, spec: GridSpec, picture: np.ndarray, mode: str, thresholds: str) -> None:
    """Write a picture (rows, cols), its first row the smallest y, and the YAML beside it."""
    with replacing(path.with_suffix(".pgm")) as file:
        file.write(f"P5\n{spec.cols} {spec.rows}\n255\n".encode())
        file.write(picture[::-1].tobytes())
    x, y = spec.origin
    with replacing(path.with_suffix(".yaml")) as file:
        file.write(
            f"image: {path.with_suffix('.pgm').name}\n"
            f"mode: {mode}\n"
            f"resolution: {spec.resolution!r}\n"
            f"origin: [{x!r}, {y!r}, 0.0]\n"
            f"{thresholds}".encode()
        )


def read_ros_map(path: AnyPath) -> OccupancyGrid:
    """Read a map by its YAML: h is 1 occupied, 0 free, 0.5 unknown, and between 0 and 1 in the
    modes `scale` and `raw`, as nav2's map_server reads them. Raises InputError.

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
    if mode not in MODES:
        raise InputError(
            f"{path}: mode {one_line(mode, 60)!r} is not read, expected {', '.join(MODES)}"
        )
    resolution = _number(path, fields, "resolution")
    if not MIN_CELL <= resolution <= MAX_CELL:
        raise InputError(
            f"{path}: expected a `resolution` from {MIN_CELL:g} to {MAX_CELL:g} m, got {resolution}"
        )
    x, y = _origin(path, fields)
    image = path.parent / _text(path, fields, "image")
    allow(image)  # a map's memory is in proportion to its picture, not to these few lines
    picture = read_picture(image)[::-1]
    spec = GridSpec(resolution, round(y / resolution), round(x / resolution), *picture.shape)
    occupied = _raw(picture) if mode == "raw" else _scaled(path, fields, picture, mode)
    known = np.isfinite(occupied)
    grid = OccupancyGrid(spec, np.where(known, occupied, 0.5), known)
    return grid, Pose2(x - spec.origin[0], y - spec.origin[1], 0.0)


def _raw(picture: np.ndarray) -> Array:
    """(rows, cols) h of a picture of percents; NaN where it has another number."""
    return np.where(picture <= MOST_PERCENT, picture / MOST_PERCENT, np.nan)


def _scaled(path: Path, fields: dict[str, str], picture: np.ndarray, mode: str) -> Array:
    """(rows, cols) h: 1 above the one threshold, 0 below the other; between them NaN, or in the
    mode `scale`, in proportion."""
    grey = picture.astype(np.float64)
    p = grey / 255 if _number(path, fields, "negate", 0.0) else (255 - grey) / 255
    high, low = _number(path, fields, "occupied_thresh"), _number(path, fields, "free_thresh")
    between = np.nan if mode == "trinary" else (p - low) / max(high - low, math.ulp(1.0))
    return np.select([p > high, p < low], [1.0, 0.0], between)


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
