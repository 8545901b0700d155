"""Looks: what the scans, one after the other, say of every cell of the surface.

The second pass. A scan says of a cell that it is occupied where an echo ends in it or beside it. It
says free only where a beam went through the place of the cell's echoes and came out well behind the
surface there: a beam that grazes a wall crosses its cells without ever being behind it. Where
another echo of the same scan lies near, it says nothing: poses err, and so would a post be missed.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from slam.geometry import Array
from slam.grid import GridSpec
from slam.kernel import kernel
from slam.layers.surface import SurfaceCells, beams
from slam.maps.rays import Rays
from slam.scan import Scan

UNKNOWN, FREE, OCCUPIED = 0, 1, 2
BEHIND = 0.10  # m across the surface: a beam that comes out so far behind it went through, ...
SPREADS = 4.0  # of the echoes across the surface, where that is more, ...
BEHIND_PER_M = 0.01  # ... and more the farther away, for headings err
ASIDE = 0.03  # m, past the place of the echoes at most
FAR = 8.0  # m: beyond, headings err too much for a beam to say that it went through
NEAR = 2  # cells around an echo of which the same scan does not say free
LONGEST = 0.15  # s that one look counts for at most: looks close in time are hardly more than one
SURE = 0.3  # s of looks of one kind, less those of the other, that make a state
LIMIT = 0.6  # s: what was seen for longer is not unlearned more slowly
TRUSTED = 3.0  # times as much as an echo beside it a beam says that went through
STILL = 2.0  # s: a gap longer than this is not watched time
PAUSE = 600.0  # s: a longer one, as from one day to another, counts for so long


class Looks(NamedTuple):
    """What was seen of each of the surface's n cells.

    state         (n,) uint8 at the end: UNKNOWN, FREE or OCCUPIED
    flips         (n,) int32, changes of state that were seen
    free_for      (n,) float32, s watched while free
    occupied_for  (n,) float32, s watched while occupied
    hits          (n,) int32, scans with an echo in the cell or beside it
    passes        (n,) int32, scans that saw it free
    first, last   (n,) float32, s since the first scan: when it was first and last looked at
    belief        (n,) float32, s of looks for occupied less those for free, within +-LIMIT
    scan          (n,) int32, the last that said anything of it
    """

    state: np.ndarray
    flips: np.ndarray
    free_for: np.ndarray
    occupied_for: np.ndarray
    hits: np.ndarray
    passes: np.ndarray
    first: np.ndarray
    last: np.ndarray
    belief: np.ndarray
    scan: np.ndarray

    @staticmethod
    def none(n: int) -> Looks:
        """Of `n` cells nothing was seen yet."""
        seconds = (np.zeros(n, np.float32) for _ in range(5))
        free_for, occupied_for, first, last, belief = seconds
        return Looks(
            np.full(n, UNKNOWN, np.uint8),
            np.zeros(n, np.int32),
            free_for,
            occupied_for,
            np.zeros(n, np.int32),
            np.zeros(n, np.int32),
            first,
            last,
            belief,
            np.full(n, -1, np.int32),
        )


def look(
    scans: Sequence[Scan], poses: Array, rays: Rays, spec: GridSpec, surface: SurfaceCells
) -> tuple[Looks, np.ndarray]:
    """The looks at the surface, and (rows, cols) bool: where any beam passed."""
    looks, passed = Looks.none(len(surface.cells)), np.zeros(spec.shape, np.bool_)
    x, y = spec.origin
    steps = np.diff([scan.time for scan in scans])
    usual = float(min(np.median(steps), LONGEST)) if len(steps) else LONGEST
    times = np.cumsum(np.clip(np.insert(steps, 0, 0.0), 0.0, PAUSE)).tolist()
    for k, (sensor, ends, hit) in enumerate(beams(scans, poses, rays)):
        moment = k, times[k], usual
        _hit(ends, hit, x, y, 1 / spec.resolution, moment, surface.number, looks)
        _pass(sensor, ends, hit, x, y, 1 / spec.resolution, moment, surface, looks, passed)
    return looks, passed


@kernel
def _hit(ends, hit, x, y, scale, moment, number, looks):
    """Cells with an echo in them or beside are occupied; those near it are not spoken of."""
    scan = moment[0]
    for k in range(len(ends)):
        if not hit[k]:
            continue
        row, col = int((ends[k, 1] - y) * scale), int((ends[k, 0] - x) * scale)
        for r in range(row - 1, row + 2):
            for c in range(col - 1, col + 2):
                i = number[r, c]
                if i >= 0 and looks.scan[i] != scan:
                    looks.hits[i] += 1
                    _see(i, True, moment, looks)
    for k in range(len(ends)):
        if not hit[k]:
            continue
        row, col = int((ends[k, 1] - y) * scale), int((ends[k, 0] - x) * scale)
        for r in range(row - NEAR, row + NEAR + 1):
            for c in range(col - NEAR, col + NEAR + 1):
                i = number[r, c]
                if i >= 0:
                    looks.scan[i] = scan


@kernel
def _pass(sensor, ends, hit, x, y, scale, moment, surface, looks, passed):
    """Follow every beam; cells of the surface that it went through are free."""
    x0, y0 = (sensor[0] - x) * scale, (sensor[1] - y) * scale
    for k in range(len(ends)):
        ex, ey = ends[k, 0] - sensor[0], ends[k, 1] - sensor[1]
        length = np.hypot(ex, ey)
        if length * scale < 1e-6:
            continue
        ex, ey = ex / length, ey / length
        row, col = int(y0), int(x0)
        step_row, step_col = 1 if ey > 0 else -1, 1 if ex > 0 else -1
        more_row = 1 / (abs(ey) * scale) if ey != 0 else np.inf
        more_col = 1 / (abs(ex) * scale) if ex != 0 else np.inf
        to_row = abs(row + (ey > 0) - y0) * more_row if ey != 0 else np.inf
        to_col = abs(col + (ex > 0) - x0) * more_col if ex != 0 else np.inf
        while True:
            i = surface.number[row, col]
            if i < 0:
                passed[row, col] = True
            elif looks.scan[i] != moment[0]:
                px, py = surface.places[i, 0] - sensor[0], surface.places[i, 1] - sensor[1]
                away = px * ex + py * ey
                nx, ny = surface.normals[i]
                across = abs(nx * ex + ny * ey) if nx != 0 or ny != 0 else 1.0
                behind = (length - away) * across
                margin = max(BEHIND, SPREADS * surface.spread[i]) + BEHIND_PER_M * away
                through = abs(px * ey - py * ex) <= ASIDE and behind >= margin
                if through and away <= FAR:
                    passed[row, col] = True
                    looks.scan[i] = moment[0]
                    looks.passes[i] += 1
                    _see(i, False, moment, looks)
            if to_row < to_col:
                if to_row >= length:
                    break
                row += step_row
                to_row += more_row
            else:
                if to_col >= length:
                    break
                col += step_col
                to_col += more_col


@kernel
def _see(i, occupied, moment, looks):
    """One look at cell `i`: add to the belief, and to the time in the state that it was in."""
    scan, now, usual = moment
    looks.scan[i] = scan
    gone = usual
    if looks.hits[i] + looks.passes[i] == 1:
        looks.first[i] = now
    else:
        gone = max(now - looks.last[i], 0.0)
    looks.last[i] = now
    weight = min(gone, LONGEST)
    belief = looks.belief[i] + (weight if occupied else -TRUSTED * weight)
    looks.belief[i] = min(max(belief, -LIMIT), LIMIT)
    was = looks.state[i]
    if gone <= STILL:
        if was == FREE:
            looks.free_for[i] += gone
        elif was == OCCUPIED:
            looks.occupied_for[i] += gone
    if looks.belief[i] >= SURE:
        looks.state[i] = OCCUPIED
    elif looks.belief[i] <= -SURE:
        looks.state[i] = FREE
    if was != UNKNOWN and looks.state[i] != was:
        looks.flips[i] += 1
