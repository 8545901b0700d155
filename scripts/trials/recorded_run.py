"""A run recorded for pictures and the replay: maps at some moments, in a small file."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from slam.benchmark.run import Playback, build
from slam.bounds import MAX_COORDINATE, bounded
from slam.episode import Episode, Truth
from slam.errors import InputError
from slam.geometry import Array
from slam.grid import GridSpec, OccupancyGrid, grown
from slam.interface import Slam
from slam.io.arrays import floats, read_arrays
from slam.io.files import replacing
from slam.io.guard import guarded
from slam.scan import Scan

from .sources import thinned

MAX_MOMENTS = 40
MAX_SIDE = 480  # cells of a recorded map along a side; a larger map is recorded in coarser cells
MAX_ECHOES = 90  # of a scan
WHAT = "a recorded run"
SHAPES = {
    "scans": (1, 0), "online": (2, 3), "poses": (2, 3), "shades": (3, 0), "extent": (1, 4),
    "truth": (2, 3), "walls": (2, 4), "doors": (3, 4), "echoes": (3, 2),
}  # fmt: skip
"""Dimensions of the arrays of a file, and the length of the last one; 0: any."""
MAY_BE_NAN = ("echoes", "doors")
NO_SEGMENTS = np.zeros((0, 4))


class RecordedRun(NamedTuple):
    """The estimates of a SLAM at some moments of an episode.

    scans   (k,) numbers of the scans at the moments
    online  (n, 3) the pose at every scan, estimated at that scan
    poses   (n, 3) the poses as estimated at the end
    shades  (k, rows, cols) uint8: 0 free to 254 occupied, 255 unknown; row 0 is the lowest
    extent  left, right, bottom, top of the shades, m
    truth   (n, 3) true poses; (0, 3) without the truth, and then no walls and doors
    walls   (w, 4) segments, m
    doors   (k, e, 4) segments of the doors at the moments
    echoes  (k, m, 2) float32 echoes, thinned, m, robot frame; NaN beyond their number
    """

    scans: np.ndarray
    online: Array
    poses: Array
    shades: np.ndarray
    extent: tuple[float, float, float, float]
    truth: Array
    walls: Array
    doors: Array
    echoes: np.ndarray


def record_run(variant: str, episode: Episode, seed: int) -> RecordedRun:
    """Run `variant` on the episode and record it."""
    return record_slam(build(variant, episode, seed), episode)


def record_slam(robot: Slam, episode: Episode) -> RecordedRun:
    """Run a SLAM on the episode and record it."""
    playback = Playback(robot, episode)
    moments = thinned(np.arange(len(episode.scans)), MAX_MOMENTS)
    wanted, seen = set(moments.tolist()), []
    for number, _ in enumerate(playback):
        if number in wanted:
            seen.append(_shades(playback.result().grid))
    spec, run = seen[-1][0], playback.result()
    for other, _ in seen[:-1]:
        spec = _joined(spec, other)
    step = -(-max(spec.shape) // MAX_SIDE)
    shades = np.stack([_coarser(grown(image, of, spec, 255), step) for of, image in seen])
    left, _, bottom, _ = spec.extent
    height, width = (side * step * spec.resolution for side in shades.shape[1:])
    extent = left, left + width, bottom, bottom + height
    truth = episode.truth or Truth(np.zeros((0, 3)), NO_SEGMENTS, np.zeros((len(moments), 0, 4)))
    doors = truth.doors if episode.truth is None else truth.doors[moments]
    echoes = np.stack([_echoes(episode.scans[k]) for k in moments])
    return RecordedRun(
        moments, run.online, run.poses, shades, extent, truth.poses, truth.walls, doors, echoes
    )


def _echoes(scan: Scan) -> np.ndarray:
    """(MAX_ECHOES, 2)."""
    found = np.full((MAX_ECHOES, 2), np.nan, np.float32)
    shown = thinned(scan.points, MAX_ECHOES)
    found[: len(shown)] = shown
    return found


def save(run: RecordedRun, path: Path) -> None:
    """Write the run to `path` (.npz)."""
    path.parent.mkdir(exist_ok=True)
    with replacing(path) as file:
        np.savez_compressed(file, **run._asdict())  # pyright: ignore[reportArgumentType]


def load(path: Path) -> RecordedRun:
    """Read what `save` wrote. Raises InputError for anything else."""
    with guarded(path):
        stored = read_arrays(path, WHAT)
        missing = [name for name in RecordedRun._fields if name not in stored]
        if missing:
            raise InputError(f"not {WHAT} (no {missing[0]})")
        kept: dict[str, Any] = {name: stored[name] for name in RecordedRun._fields}
        _check(kept)
    return RecordedRun(**kept)._replace(extent=tuple(kept["extent"].tolist()))


def _check(kept: dict[str, Any]) -> None:
    """Raises InputError for arrays that a picture cannot be made of."""
    for name, (dimensions, columns) in SHAPES.items():
        array = floats(kept[name], dimensions)
        if columns and array.shape[-1] != columns:
            raise InputError(f"not {WHAT} ({name} of shape {array.shape})")
        if name not in MAY_BE_NAN and not bounded(array, MAX_COORDINATE):
            raise InputError(f"not {WHAT} ({name} beyond {MAX_COORDINATE:g})")
    moments = {len(kept[name]) for name in ("scans", "shades", "doors", "echoes")}
    if len(moments) != 1 or 0 in (*moments, *kept["shades"].shape):
        raise InputError(f"not {WHAT} (arrays of different lengths)")
    if kept["shades"].dtype != np.uint8 or kept["scans"].dtype.kind not in "iu":
        raise InputError(f"not {WHAT} (numbers of another type)")


def _shades(grid: OccupancyGrid) -> tuple[GridSpec, np.ndarray]:
    image = np.round(254 * np.clip(grid.occupied, 0.0, 1.0)).astype(np.uint8)
    image[~grid.observed] = 255
    return grid.spec, image


def _joined(a: GridSpec, b: GridSpec) -> GridSpec:
    row0, col0 = min(a.row0, b.row0), min(a.col0, b.col0)
    row1, col1 = max(a.row0 + a.rows, b.row0 + b.rows), max(a.col0 + a.cols, b.col0 + b.cols)
    return GridSpec(a.resolution, row0, col0, row1 - row0, col1 - col0)


def _coarser(image: np.ndarray, step: int) -> np.ndarray:
    """Blocks of `step` x `step` cells as one cell: the most occupied observed one."""
    if step == 1:
        return image
    rows, cols = (-(-side // step) * step for side in image.shape)
    padded = np.full((rows, cols), 255, np.uint8)
    padded[: image.shape[0], : image.shape[1]] = image
    squares = padded.reshape(rows // step, step, cols // step, step).swapaxes(1, 2)
    squares = squares.reshape(rows // step, cols // step, -1)
    known = np.where(squares == 255, 0, squares).max(axis=2)
    return np.where((squares == 255).all(axis=2), 255, known).astype(np.uint8)
