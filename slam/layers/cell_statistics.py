"""Per-cell observation statistics of the surface cells, over all scans.

The second pass. A scan observes a cell as occupied if an echo ends in it or in a neighbour. It
observes a cell as free only if a beam passes the mean of the cell's echoes closely and ends well
behind the surface: a beam that grazes a wall crosses its cells without passing through it. A cell
near another echo of the same scan is not observed as free: with errors of the pose, posts would be
missed.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from slam.geometry import Array
from slam.grid import GridSpec
from slam.kernel import kernel
from slam.layers.glass import Incidence, meet
from slam.layers.sides import Sides, see
from slam.layers.surface import SurfaceCells, beams
from slam.maps.rays import Rays
from slam.scan import Scan

UNKNOWN, FREE, OCCUPIED = 0, 1, 2
# m behind the surface, across it, at which a beam that passes through must end: at least ...
MIN_BEHIND = 0.10
MIN_BEHIND_SPREADS = 4.0  # ... or so many standard deviations of the echoes across the surface, ...
BEHIND_PER_M = 0.01  # ... and more with the distance, for errors of the heading
MAX_ASIDE = 0.03  # m between such a beam and the mean of the cell's echoes
MAX_PASS_RANGE = 8.0  # m; farther away the error of the heading is too large to tell
ECHO_RADIUS = 2  # cells around an echo that the same scan does not observe as free
MAX_WEIGHT = 0.15  # s, of one observation: those close in time are not independent
MIN_BELIEF = 0.3  # s of observations of one state, less those of the other, to take it on
MAX_BELIEF = 0.6  # s; a longer observed state is not slower to change
PASS_WEIGHT = 3.0  # weight of a beam that passes through, by that of an echo
MAX_WATCHED_GAP = 2.0  # s between two observations for the time between to count as watched
MAX_PAUSE = 600.0  # s; a longer gap between scans, as from day to day, is shortened to this


class CellStatistics(NamedTuple):
    """Observations of each of the surface's n cells.

    state         (n,) uint8, final state: UNKNOWN, FREE or OCCUPIED
    flips         (n,) int32, number of observed changes of state
    free_for      (n,) float32, s watched while free
    occupied_for  (n,) float32, s watched while occupied
    hits          (n,) int32, number of scans with an echo in the cell or beside it
    passes        (n,) int32, number of scans that observed it as free
    last          (n,) float32, s from the first scan to its last observation
    belief        (n,) float32, s of observations as occupied less as free, within +-MAX_BELIEF
    scan          (n,) int32, number of the last scan that observed it or had an echo nearby
    sides         observations from each side
    """

    state: np.ndarray
    flips: np.ndarray
    free_for: np.ndarray
    occupied_for: np.ndarray
    hits: np.ndarray
    passes: np.ndarray
    last: np.ndarray
    belief: np.ndarray
    scan: np.ndarray
    sides: Sides
    incidence: Incidence

    @staticmethod
    def none(n: int) -> CellStatistics:
        """Of `n` cells, without an observation."""
        seconds = (np.zeros(n, np.float32) for _ in range(4))
        free_for, occupied_for, last, belief = seconds
        return CellStatistics(
            np.full(n, UNKNOWN, np.uint8),
            np.zeros(n, np.int32),
            free_for,
            occupied_for,
            np.zeros(n, np.int32),
            np.zeros(n, np.int32),
            last,
            belief,
            np.full(n, -1, np.int32),
            Sides.none(n),
            Incidence.none(n),
        )


def session_times(scans: Sequence[Scan]) -> Array:
    """(n,) s from the first scan; pauses between scans, as from day to day, are shortened."""
    steps = np.diff([scan.time for scan in scans], prepend=scans[0].time)
    return np.cumsum(np.clip(steps, 0.0, MAX_PAUSE))


def observe(
    scans: Sequence[Scan], poses: Array, rays: Rays, spec: GridSpec, surface: SurfaceCells
) -> tuple[CellStatistics, np.ndarray]:
    """The statistics of the surface cells, and (rows, cols) bool: cells that any beam crossed."""
    cells, passed = CellStatistics.none(len(surface.cells)), np.zeros(spec.shape, np.bool_)
    x, y = spec.origin
    steps = np.diff([scan.time for scan in scans])
    usual = float(min(np.median(steps), MAX_WEIGHT)) if len(steps) else MAX_WEIGHT
    times = session_times(scans).tolist()
    for k, (sensor, ends, hit) in enumerate(beams(scans, poses, rays)):
        moment = k, times[k], usual
        _add_hits(sensor, ends, hit, x, y, 1 / spec.resolution, moment, surface, cells)
        _add_passes(sensor, ends, hit, x, y, 1 / spec.resolution, moment, surface, cells, passed)
    return cells, passed


@kernel
def _add_hits(sensor, ends, hit, x, y, scale, moment, surface, cells):
    """Observe cells with an echo in or beside them as occupied; mark those nearby as done."""
    scan, number = moment[0], surface.number
    for k in range(len(ends)):
        if not hit[k]:
            continue
        row, col = int((ends[k, 1] - y) * scale), int((ends[k, 0] - x) * scale)
        for r in range(row - 1, row + 2):
            for c in range(col - 1, col + 2):
                i = number[r, c]
                if i >= 0 and cells.scan[i] != scan:
                    cells.hits[i] += 1
                    px, py = surface.places[i, 0] - sensor[0], surface.places[i, 1] - sensor[1]
                    see(i, px, py, True, cells.sides)
                    meet(i, _cosine(px, py, surface.normals[i]), True, cells.incidence)
                    _add(i, True, moment, cells)
    for k in range(len(ends)):
        if not hit[k]:
            continue
        row, col = int((ends[k, 1] - y) * scale), int((ends[k, 0] - x) * scale)
        for r in range(row - ECHO_RADIUS, row + ECHO_RADIUS + 1):
            for c in range(col - ECHO_RADIUS, col + ECHO_RADIUS + 1):
                i = number[r, c]
                if i >= 0:
                    cells.scan[i] = scan


@kernel
def _add_passes(sensor, ends, hit, x, y, scale, moment, surface, cells, passed):
    """Trace every beam; observe surface cells that it passes through as free."""
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
            elif cells.scan[i] != moment[0]:
                px, py = surface.places[i, 0] - sensor[0], surface.places[i, 1] - sensor[1]
                away = px * ex + py * ey
                nx, ny = surface.normals[i]
                across = abs(nx * ex + ny * ey) if nx != 0 or ny != 0 else 1.0
                behind = (length - away) * across
                margin = (
                    max(MIN_BEHIND, MIN_BEHIND_SPREADS * surface.spread[i]) + BEHIND_PER_M * away
                )
                through = abs(px * ey - py * ex) <= MAX_ASIDE and behind >= margin
                if through and away <= MAX_PASS_RANGE:
                    passed[row, col] = True
                    cells.scan[i] = moment[0]
                    cells.passes[i] += 1
                    see(i, px, py, False, cells.sides)
                    meet(i, across, False, cells.incidence)
                    _add(i, False, moment, cells)
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
def _cosine(x, y, normal):
    """Of the angle of incidence of a beam along (x, y) on a surface; 0 without a normal."""
    away = np.hypot(x, y)
    return abs(x * normal[0] + y * normal[1]) / away if away > 0 else 0.0


@kernel
def _add(i, occupied, moment, cells):
    """Add an observation of cell `i` to its belief and to the time in its state."""
    scan, now, usual = moment
    cells.scan[i] = scan
    gone = usual
    if cells.hits[i] + cells.passes[i] > 1:
        gone = max(now - cells.last[i], 0.0)
    cells.last[i] = now
    weight = min(gone, MAX_WEIGHT)
    belief = cells.belief[i] + (weight if occupied else -PASS_WEIGHT * weight)
    cells.belief[i] = min(max(belief, -MAX_BELIEF), MAX_BELIEF)
    was = cells.state[i]
    if gone <= MAX_WATCHED_GAP:
        if was == FREE:
            cells.free_for[i] += gone
        elif was == OCCUPIED:
            cells.occupied_for[i] += gone
    if cells.belief[i] >= MIN_BELIEF:
        cells.state[i] = OCCUPIED
    elif cells.belief[i] <= -MIN_BELIEF:
        cells.state[i] = FREE
    if was != UNKNOWN and cells.state[i] != was:
        cells.flips[i] += 1
