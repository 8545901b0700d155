"""What each scan tells of gaps in walls: whether it saw through them, or a closed leaf in them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from slam.geometry import Array
from slam.kernel import kernel
from slam.layers.surface import beams
from slam.maps.rays import Rays
from slam.scan import Scan

NOTHING, OPEN, CLOSED = 0, 1, 2
REACH = 10.0  # m from the laser to a gap, from which beams tell
MIN_ASIDE = 0.2  # m of the laser from a gap's line
EDGE = 0.15  # of the width at either end of a gap, where beams hit the jamb
LEAF_DEPTH, DEPTH_PER_M = 0.06, 0.005  # m from a gap's line, of echoes of the leaf
BEHIND = 0.25  # m behind the line that a beam ends which saw through: errors of poses are less
MIN_BEAMS = 2  # of a scan that tells
MIN_SPAN = 0.3  # of the width between the beams that end on a closed leaf: people are narrower
MAX_WATCHED_GAP = 2.0  # s between two looks for the time between to count as watched
MIN_ROW = 3  # looks in a row of one state, for a change of the state


class Views(NamedTuple):
    """The scans of a drive, with their poses (n, 3), the rays that tell how far beams reach, and
    times (n,), s."""

    scans: Sequence[Scan]
    poses: Array
    rays: Rays
    times: Array


class Looks(NamedTuple):
    """What was seen of one gap.

    opened, closed  scans that saw it so
    row_open        most scans in a row that saw it open; row_closed: that saw it closed
    flips           changes from open to closed and back, of MIN_ROW looks each
    watched         s between looks that follow each other closely
    open_share      share of `watched` in which it was open; of the looks, if none was watched
    first, last     s, times of the first and the last look
    """

    opened: int
    closed: int
    row_open: int
    row_closed: int
    flips: int
    watched: float
    open_share: float
    first: float
    last: float


def look(views: Views, gaps: Array) -> list[Looks]:
    """What the scans saw of gaps (g, 2, 2), m, map frame."""
    times = views.times
    seen = np.zeros((len(gaps), len(times)), np.uint8)
    lines = gaps.reshape(-1, 4)
    for k, (sensor, ends, _) in enumerate(beams(*views[:3])):
        _look(sensor, ends, lines, seen[:, k])
    return [_summed(times[row != NOTHING], row[row != NOTHING]) for row in seen]


@kernel
def _look(sensor, ends, lines, seen):
    """Set `seen` (g,) for gaps `lines` (g, 4), by a scan's beams from `sensor` to `ends` (n, 2)."""
    for g in range(len(lines)):
        x, y = lines[g, 0], lines[g, 1]
        tx, ty = lines[g, 2] - x, lines[g, 3] - y
        width = np.hypot(tx, ty)
        tx, ty = tx / width, ty / width
        sx, sy = sensor[0] - x, sensor[1] - y
        from_along, from_across = sx * tx + sy * ty, sy * tx - sx * ty
        far = np.hypot(from_along - width / 2, from_across)
        side = 1.0 if from_across > 0 else -1.0
        from_across *= side
        if far > REACH or from_across < MIN_ASIDE:
            continue
        low, high = EDGE * width, (1 - EDGE) * width
        depth = LEAF_DEPTH + DEPTH_PER_M * far
        through, on, first, last = 0, 0, width, 0.0
        for k in range(len(ends)):
            ex, ey = ends[k, 0] - x, ends[k, 1] - y
            across = side * (ey * tx - ex * ty)
            if across > depth:
                continue
            along = ex * tx + ey * ty
            if across >= -depth:
                if low < along < high:
                    on += 1
                    first, last = min(first, along), max(last, along)
            elif across < -BEHIND:
                at = from_along + (along - from_along) * from_across / (from_across - across)
                through += low < at < high
        if through >= MIN_BEAMS and on == 0:
            seen[g] = OPEN
        elif on >= MIN_BEAMS and through == 0 and last - first >= MIN_SPAN * width:
            seen[g] = CLOSED


def _summed(times: Array, states: np.ndarray) -> Looks:
    if not len(states):
        return Looks(0, 0, 0, 0, 0, 0.0, 0.0, 0.0, 0.0)
    begins = np.flatnonzero(np.append(True, states[1:] != states[:-1]))
    lengths, kinds = np.diff(np.append(begins, len(states))), states[begins]
    sure = kinds[lengths >= MIN_ROW]
    gaps = np.diff(times)
    near = gaps <= MAX_WATCHED_GAP
    watched = float(gaps[near].sum())
    opened = float(gaps[near & (states[:-1] == OPEN)].sum())
    share = opened / watched if watched else float((states == OPEN).mean())
    return Looks(
        int((states == OPEN).sum()), int((states == CLOSED).sum()),
        int(lengths[kinds == OPEN].max(initial=0)), int(lengths[kinds == CLOSED].max(initial=0)),
        int((sure[1:] != sure[:-1]).sum()), watched, share, float(times[0]), float(times[-1]),
    )  # fmt: skip
