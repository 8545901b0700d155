"""Boxes of the bodies in Chipmunk's index of shapes, which say when it sorts a body in anew.

Where several solids touch at once, the order in which Chipmunk meets them decides the last digits
of the impulses, and the order follows from the steps in which bodies left their boxes. Those steps
are kept while Chipmunk does not run, and made again before it does.
"""

from __future__ import annotations

import math

import numpy as np

from dynslam_env.simulation.bodies import NOBODY, SEVERAL
from dynslam_env.simulation.columns import MARGIN, RADIUS, SIDE, WIDTH
from slam.kernel import kernel

ROUNDING = 1e-9  # m, more than the errors of distances
SLACK = float(np.float32(0.1))  # share of its size, and s of its velocity, by which a box is larger


@kernel(error_model="numpy")
def sort_in(rows, velocities, parts, leaves, boxes):
    """Give new boxes to the bodies that left theirs or have none; who did, NOBODY, or SEVERAL.

    rows        where the bodies are
    velocities  rows with the velocities with which they came there
    boxes       (1 + d + p, 8) written: the box, left, bottom, right, top, m; a state x, y, angle of
                the body within it, and how far, m, the body's own box was then from its edges
    """
    left_it = NOBODY
    for b in range(len(parts)):
        vx, vy = velocities[b, 3], velocities[b, 4]
        resting = vx == 0.0 and vy == 0.0 and velocities[b, 5] == 0.0
        if resting and boxes[b, 0] < boxes[b, 2]:  # it has a box
            continue
        is_leaf = 1 <= b <= leaves
        moved = abs(rows[b, 0] - boxes[b, 4]) + abs(rows[b, 1] - boxes[b, 5])
        if is_leaf:
            turned = abs(rows[b, 2] - boxes[b, 6])
            moved += turned * (parts[b, WIDTH] + abs(parts[b, SIDE]))
        if moved < boxes[b, 7] - ROUNDING:  # it cannot have left its box
            continue
        left, bottom, right, top = box_of(rows, b, parts, is_leaf)
        inside = min(left - boxes[b, 0], boxes[b, 2] - right,
                     bottom - boxes[b, 1], boxes[b, 3] - top)  # fmt: skip
        boxes[b, 4], boxes[b, 5], boxes[b, 6] = rows[b, 0], rows[b, 1], rows[b, 2]
        boxes[b, 7] = inside
        if inside >= 0.0:
            continue
        wide, high = (right - left) * SLACK, (top - bottom) * SLACK
        boxes[b, 0], boxes[b, 1] = left + min(-wide, vx * SLACK), bottom + min(-high, vy * SLACK)
        boxes[b, 2], boxes[b, 3] = right + max(wide, vx * SLACK), top + max(high, vy * SLACK)
        boxes[b, 7] = 0.0
        left_it = b if left_it == NOBODY else SEVERAL
    return left_it


@kernel(error_model="numpy")
def box_of(rows, b, parts, is_leaf):
    """The box around a body with its margin, m: left, bottom, right, top."""
    x, y = rows[b, 0], rows[b, 1]
    if not is_leaf:
        r = parts[b, RADIUS]
        return x - r, y - r, x + r, y + r
    width, side, margin = parts[b, WIDTH], parts[b, SIDE], parts[b, MARGIN]
    c, s = math.cos(rows[b, 2]), math.sin(rows[b, 2])
    across_x, across_y = -s * side, c * side
    left = min(0.0, c * width) + min(0.0, across_x)
    right = max(0.0, c * width) + max(0.0, across_x)
    bottom = min(0.0, s * width) + min(0.0, across_y)
    top = max(0.0, s * width) + max(0.0, across_y)
    return x + left - margin, y + bottom - margin, x + right + margin, y + top + margin
