"""Boxes of the bodies in Chipmunk's index of shapes, which say when it sorts a body in anew.

Where several solids touch at once, the order in which Chipmunk meets them decides the last digits
of the impulses, and the order follows from the steps in which bodies left their boxes. Those steps
are kept while Chipmunk does not run, and made again before it does.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dynslam_env.simulation.columns import MARGIN, RADIUS, SIDE, WIDTH
from slam.geometry import Array
from slam.kernel import kernel

SLACK = float(np.float32(0.1))  # share of its size, and s of its velocity, by which a box is larger
MOST_STEPS = 64  # physics steps that are kept


class IndexBoxes(NamedTuple):
    """The boxes, and the physics steps in which bodies left them.

    boxes   (bodies, 4) m, left, bottom, right, top
    before  (MOST_STEPS + 1, rows, 6) the rows of `Bodies` before these steps
    last    (rows, 6) the same before the last step of all
    kept    (1,) number of these steps
    """

    boxes: Array
    before: Array
    last: Array
    kept: NDArray[np.int64]


def index_boxes(rows: Array, parts: Array, leaves: int) -> IndexBoxes:
    """Boxes of bodies at rest, as `Bodies` holds them."""
    boxes = np.full((len(parts), 4), np.nan)  # which contains nothing
    kept = np.zeros(1, dtype=np.int64)
    sort_in(rows, np.zeros_like(rows), parts, leaves, boxes)
    return IndexBoxes(boxes, np.empty((MOST_STEPS + 1, *rows.shape)), np.zeros_like(rows), kept)


@kernel
def sort_in(rows, velocities, parts, leaves, boxes):
    """Give new boxes to the bodies that left theirs; whether any did.

    rows        where the bodies are
    velocities  rows with the velocities with which they came there
    """
    any_left = False
    for b in range(len(parts)):
        vx, vy = velocities[b, 3], velocities[b, 4]
        resting = vx == 0.0 and vy == 0.0 and velocities[b, 5] == 0.0
        if resting and boxes[b, 0] == boxes[b, 0]:
            continue
        left, bottom, right, top = box_of(rows[b], parts[b], 1 <= b <= leaves)
        box = boxes[b]
        if box[0] <= left and box[2] >= right and box[1] <= bottom and box[3] >= top:
            continue
        wide, high = (right - left) * SLACK, (top - bottom) * SLACK
        box[0], box[1] = left + min(-wide, vx * SLACK), bottom + min(-high, vy * SLACK)
        box[2], box[3] = right + max(wide, vx * SLACK), top + max(high, vy * SLACK)
        any_left = True
    return any_left


@kernel
def box_of(row, part, is_leaf):
    """The box around a body with its margin, m: left, bottom, right, top."""
    x, y = row[0], row[1]
    if not is_leaf:
        r = part[RADIUS]
        return x - r, y - r, x + r, y + r
    c, s, width, side, margin = (
        math.cos(row[2]), math.sin(row[2]), part[WIDTH], part[SIDE], part[MARGIN]
    )  # fmt: skip
    across_x, across_y = -s * side, c * side
    left = min(0.0, c * width) + min(0.0, across_x)
    right = max(0.0, c * width) + max(0.0, across_x)
    bottom = min(0.0, s * width) + min(0.0, across_y)
    top = max(0.0, s * width) + max(0.0, across_y)
    return x + left - margin, y + bottom - margin, x + right + margin, y + top + margin
