"""A run to be looked at: the map in a few moments, small enough to be kept."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from slam.benchmark.run import Playback, build
from slam.episode import Episode, Truth
from slam.geometry import Array
from slam.grid import GridSpec, OccupancyGrid, grown
from slam.io.files import replacing
from slam.scan import Scan

from .sources import thinned

MOMENTS = 40
LARGEST = 480  # cells a side of what is kept: a larger map is kept in coarser cells
BEAMS = 90  # that are shown of a scan
NOTHING = np.zeros((0, 4))


class Example(NamedTuple):
    """What a SLAM believed at some moments of an episode.

    scans   (k,) numbers of the scans of the moments
    online  (n, 3) the pose at every scan, as believed when it came
    poses   (n, 3) as believed at the end
    shades  (k, rows, cols) uint8: 0 free to 254 occupied, 255 unknown; row 0 is the lowest
    extent  left, right, bottom, top of the shades, m
    truth   (n, 3) true poses; none of a log without the truth, as walls and doors
    walls   (w, 4) segments, m
    doors   (k, e, 4) segments of what moves, at the moments
    echoes  (k, m, 2) float32 ends of some beams, m, robot frame; NaN where there was no echo
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


def example(variant: str, episode: Episode, seed: int) -> Example:
    """Run `variant` again, and look at it now and then."""
    playback = Playback(build(variant, episode, seed), episode)
    moments = thinned(np.arange(len(episode.scans)), MOMENTS)
    wanted, seen = set(moments.tolist()), []
    for number, _ in enumerate(playback):
        if number in wanted:
            seen.append(_shades(playback.result().grid))
    spec, run = seen[-1][0], playback.result()
    for other, _ in seen[:-1]:
        spec = _joined(spec, other)
    step = -(-max(spec.shape) // LARGEST)
    shades = np.stack([_coarser(grown(image, of, spec, 255), step) for of, image in seen])
    left, _, bottom, _ = spec.extent
    height, width = (side * step * spec.resolution for side in shades.shape[1:])
    extent = left, left + width, bottom, bottom + height
    truth = episode.truth or Truth(np.zeros((0, 3)), NOTHING, np.zeros((len(moments), 0, 4)))
    doors = truth.doors if episode.truth is None else truth.doors[moments]
    echoes = np.stack([_echoes(episode.scans[k]) for k in moments])
    return Example(
        moments, run.online, run.poses, shades, extent, truth.poses, truth.walls, doors, echoes
    )


def _echoes(scan: Scan) -> np.ndarray:
    """(BEAMS, 2)."""
    found = np.full((BEAMS, 2), np.nan, np.float32)
    shown = thinned(scan.points, BEAMS)
    found[: len(shown)] = shown
    return found


def save(example: Example, path: Path) -> None:
    """Write it to `path` (.npz)."""
    path.parent.mkdir(exist_ok=True)
    with replacing(path) as file:
        np.savez_compressed(file, **example._asdict())  # pyright: ignore[reportArgumentType]


def load(path: Path) -> Example:
    """What `save` wrote."""
    with np.load(path, allow_pickle=False) as stored:
        kept: dict[str, Any] = {name: stored[name] for name in Example._fields}
    return Example(**kept)._replace(extent=tuple(kept["extent"].tolist()))


def _shades(grid: OccupancyGrid) -> tuple[GridSpec, np.ndarray]:
    image = np.round(254 * np.clip(grid.occupied, 0.0, 1.0)).astype(np.uint8)
    image[~grid.observed] = 255
    return grid.spec, image


def _joined(a: GridSpec, b: GridSpec) -> GridSpec:
    row0, col0 = min(a.row0, b.row0), min(a.col0, b.col0)
    row1, col1 = max(a.row0 + a.rows, b.row0 + b.rows), max(a.col0 + a.cols, b.col0 + b.cols)
    return GridSpec(a.resolution, row0, col0, row1 - row0, col1 - col0)


def _coarser(image: np.ndarray, step: int) -> np.ndarray:
    """Squares of `step` cells as one: the most occupied of them that is known."""
    if step == 1:
        return image
    rows, cols = (-(-side // step) * step for side in image.shape)
    padded = np.full((rows, cols), 255, np.uint8)
    padded[: image.shape[0], : image.shape[1]] = image
    squares = padded.reshape(rows // step, step, cols // step, step).swapaxes(1, 2)
    squares = squares.reshape(rows // step, cols // step, -1)
    known = np.where(squares == 255, 0, squares).max(axis=2)
    return np.where((squares == 255).all(axis=2), 255, known).astype(np.uint8)
