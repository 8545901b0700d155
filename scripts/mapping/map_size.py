"""How large the written maps will be, and whether they fit into memory: before it is taken."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from slam.errors import InputError
from slam.geometry import Array, Pose2
from slam.grid import MOST_CELLS
from slam.maps.rays import Rays
from slam.scan import Scan

from ..console.free_memory import free_memory

BYTES_PER_CELL = 100  # of layers, masks, and pictures at once; measured on csail
MAX_SCANS = 2000  # evenly spaced, whose echoes are looked at
BOUNDS = 0.005, 1.0  # m: of the resolutions that make sense
ROUNDED_UP = 1.02  # of a proposed resolution


def check_resolution(resolution: float) -> None:
    """Raise InputError for a side of a cell, m, that makes no sense."""
    low, high = BOUNDS
    if not (math.isfinite(resolution) and low <= resolution <= high):
        raise InputError(f"--resolution must be from {low:g} to {high:g} m, got {resolution:g}")


def check_size(scans: Sequence[Scan], poses: Array, resolution: float) -> None:
    """Raise InputError if a map of the scans at `poses` (n, 3) in cells of `resolution` (m) would
    have more cells than any map may have, or need more memory than is free; the message proposes
    a resolution that fits."""
    width, height = _size(scans, poses)
    cells = width * height / resolution**2
    most = min(MOST_CELLS, free_memory() / BYTES_PER_CELL)
    if cells <= most:
        return
    fits = ROUNDED_UP * math.sqrt(width * height / most)
    raise InputError(
        f"--resolution {resolution:g}: a map of {width:.0f} x {height:.0f} m would have "
        f"{cells / 1e6:.0f} million cells and need {cells * BYTES_PER_CELL / 1e9:.1f} GB; "
        f"{most / 1e6:.0f} million fit: --resolution {_rounded(fits)} or coarser, or fewer metres "
        f"(--max-range, --from, --to)"
    )


def _size(scans: Sequence[Scan], poses: Array) -> tuple[float, float]:
    """Width and height, m, of the box around what the scans see."""
    chosen = np.unique(np.linspace(0, len(scans) - 1, min(len(scans), MAX_SCANS)).astype(int))
    low, high = np.full(2, np.inf), np.full(2, -np.inf)
    for k in chosen.tolist():
        sensor, ends, _ = Rays().ends(scans[k], Pose2.of(poses[k]))
        points = np.vstack([ends, sensor])
        low, high = np.minimum(low, points.min(axis=0)), np.maximum(high, points.max(axis=0))
    width, height = (high - low).tolist()
    return width, height


def _rounded(resolution: float) -> str:
    """A resolution with two digits, rounded up."""
    digits = 1 - math.floor(math.log10(resolution))
    return f"{math.ceil(resolution * 10**digits) / 10**digits:g}"
