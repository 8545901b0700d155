"""The bodies of a world while nothing touches anything: the same numbers as Chipmunk's, in a
fraction of the time.

Chipmunk solves all joints by ten rounds of impulses (Catto 2005, sequential impulses). Without
contacts no joint depends on another, and each is a few lines of arithmetic. Here they are written
in Chipmunk's order of operations, so that a world may pass from one to the other at any step.
"""

from __future__ import annotations

import math

import numpy as np

from dynslam_env.simulation.bodies import (
    DRIVEN,
    FIXTURE_MARGIN,
    FIXTURES,
    KEPT,
    LEAVES,
    NOBODY,
    PEOPLE,
    SEVERAL,
    STATE_SIZE,
    STOPPED,
    SUBSTEPS,
    Bodies,
)
from dynslam_env.simulation.columns import (
    INVERSE_INERTIA,
    INVERSE_MASS,
    MARGIN,
    MAX_ANGLE,
    MAX_PULL,
    MAX_TURN,
    MIN_ANGLE,
    RADIUS,
    SIDE,
    WIDTH,
)
from dynslam_env.simulation.index_boxes import box_of, sort_in
from dynslam_env.simulation.swinging import ROUNDS
from slam.kernel import kernel

FAR = 1e-6  # m, more than the errors of distances: what is off by more need not be measured
CLEARANCE = 1e-6  # m: nearer than that, Chipmunk looks whether two solids touch
SMALLEST = np.finfo(np.float64).tiny  # which Chipmunk adds to a length before it divides by it


@kernel(error_model="numpy")
def move_freely(bodies: Bodies, segments, dt):
    """Move the bodies by SUBSTEPS physics steps of `dt` s, the leaves as `swing_ahead` found.

    False where any would touch; then none is moved.

    segments  (w, 4) m, walls and the edges of immovable leaves, then others
    """
    numbers, rows, impulses, parts, boxes, rates, last, who, before, swung, _ = bodies
    leaves, people = int(numbers[LEAVES]), int(numbers[PEOPLE])
    pairs = _pairs(rows, parts, rates, numbers, segments, SUBSTEPS * dt)
    moved, pushed, sorted_in, kept = rows, impulses, boxes, int(numbers[KEPT])
    if len(pairs):
        moved, pushed, sorted_in = rows.copy(), impulses.copy(), boxes.copy()
    left_box, first = False, kept if len(pairs) else 0  # of the steps that may be overwritten
    for step in range(SUBSTEPS):
        _copy(moved, before[kept])
        _drift(moved, dt)
        for m in range(len(pairs)):
            gap = _gap(pairs[m, 0], pairs[m, 1], moved, parts, leaves, segments, numbers)
            if gap < CLEARANCE:
                return False
        who[kept] = sort_in(moved, moved, parts, leaves, sorted_in)
        left_box = who[kept] != NOBODY
        if left_box and kept > first and who[kept] == who[kept - 1] != SEVERAL:
            _copy(before[kept], before[kept - 1])  # the last of a body's steps in a row is enough
        else:
            kept += left_box
        _drive(moved, pushed, parts, leaves, people)
        for k in range(leaves):
            moved[1 + k, 5] = swung[step, k]
    for k in range(leaves):
        pushed[1 + k, 0], pushed[1 + k, 1] = swung[DRIVEN, k], swung[STOPPED, k]
    if len(pairs):
        rows[:], impulses[:], boxes[:] = moved, pushed, sorted_in
    _copy(before[kept - 1 if left_box else kept], last)
    numbers[KEPT] = kept
    return True


@kernel(error_model="numpy")
def _copy(rows, target):
    """As `target[:] = rows`, in a third of its time."""
    for b in range(len(rows)):
        for k in range(STATE_SIZE):
            target[b, k] = rows[b, k]


@kernel(error_model="numpy")
def _drift(rows, dt):
    for b in range(len(rows)):
        for k in range(3):
            rows[b, k] += rows[b, 3 + k] * dt


@kernel(error_model="numpy")
def _drive(rows, impulses, parts, leaves, people):
    """The joints of the robot and of people."""
    wheels = 1 + leaves + people
    _pull(rows, 0, wheels, impulses, parts)
    _turn(rows, wheels, impulses, parts)
    for k in range(1, 1 + people):
        _pull(rows, leaves + k, wheels + k, impulses, parts)


@kernel(error_model="numpy")
def _pairs(rows, parts, rates, numbers, segments, duration):
    """(m, 2) the pairs that may touch within `duration` s: the row of the robot or of a person, and
    the segment from 0 on, or -1 - the row of a leaf or of another person."""
    leaves, fixed = len(rates), int(numbers[FIXTURES])
    discs = 1 + int(numbers[PEOPLE])
    pairs = np.empty((discs * (fixed + leaves + discs), 2), dtype=np.int64)
    found = 0
    for k in range(discs):
        b = 0 if k == 0 else leaves + k
        reach = _travel(rows, b, discs + leaves + k, duration) + CLEARANCE
        x, y = rows[b, 0], rows[b, 1]
        around = reach + parts[b, RADIUS] + numbers[FIXTURE_MARGIN] + FAR
        for s in range(fixed):
            if _is_off(x, y, segments, s, around):
                continue
            if _gap(b, s, rows, parts, leaves, segments, numbers) < reach:
                pairs[found, 0], pairs[found, 1] = b, s
                found += 1
        for d in range(1, 1 + leaves):
            swept = reach + _sweep(rows, d, rates[d - 1], parts, duration)
            longest = parts[d, WIDTH] + abs(parts[d, SIDE]) + parts[d, MARGIN]
            off = max(abs(rows[d, 0] - x), abs(rows[d, 1] - y))
            if off > swept + parts[b, RADIUS] + longest + FAR:
                continue
            if _gap(b, -1 - d, rows, parts, leaves, segments, numbers) < swept:
                pairs[found, 0], pairs[found, 1] = b, -1 - d
                found += 1
        for j in range(k):
            c = 0 if j == 0 else leaves + j
            met = reach + _travel(rows, c, discs + leaves + j, duration)
            if _gap(b, -1 - c, rows, parts, leaves, segments, numbers) < met:
                pairs[found, 0], pairs[found, 1] = b, -1 - c
                found += 1
    return pairs[:found]


@kernel(error_model="numpy")
def _is_off(x, y, segments, i, distance):
    """Whether the box of a segment is farther from a point than `distance`, m."""
    x1, y1, x2, y2 = segments[i, 0], segments[i, 1], segments[i, 2], segments[i, 3]
    left, right = (x1, x2) if x1 < x2 else (x2, x1)
    low, high = (y1, y2) if y1 < y2 else (y2, y1)
    return (  # all four are computed: a processor guesses wrongly which come first
        (left > x + distance) | (right < x - distance)
        | (low > y + distance) | (high < y - distance)
    )  # fmt: skip


@kernel(error_model="numpy")
def _travel(rows, b, puller, duration):
    """How far a body can come in `duration` s, m: it is never faster than it is and shall be."""
    speed2 = rows[b, 3] ** 2 + rows[b, 4] ** 2
    wanted2 = rows[puller, 3] ** 2 + rows[puller, 4] ** 2
    return math.sqrt(max(speed2, wanted2)) * duration


@kernel(error_model="numpy")
def _sweep(rows, b, rate, parts, duration):
    """How far the farthest corner of a leaf can come in `duration` s, m, turning or sliding."""
    angle = rows[b, 2]
    beyond = max(parts[b, MIN_ANGLE] - angle, angle - parts[b, MAX_ANGLE], 0.0)
    turn = max(abs(rows[b, 5]), abs(rate)) * duration + beyond
    slid = math.sqrt(rows[b, 3] ** 2 + rows[b, 4] ** 2) * duration
    return turn * (parts[b, WIDTH] + abs(parts[b, SIDE])) + slid


@kernel(error_model="numpy")
def _gap(b, other, rows, parts, leaves, segments, numbers):
    """m between body `b`, a disc, and another solid, their margins included: see `_pairs`.

    The robot's from a segment is exact. Others are those between boxes: where boxes overlap,
    Chipmunk begins to search for the nearest corners, and begins with these the next time.
    """
    margin = numbers[FIXTURE_MARGIN]
    if b == 0 and other >= 0:
        distance = _distance(rows[0, 0], rows[0, 1], segments, other)
        return distance - margin - parts[0, RADIUS]
    box = box_of(rows, b, parts, False)
    if other < 0:
        return _between(box, box_of(rows, -1 - other, parts, 1 <= -1 - other <= leaves))
    x1, y1, x2, y2 = (
        segments[other, 0], segments[other, 1], segments[other, 2], segments[other, 3]
    )  # fmt: skip
    low, high = (min(x1, x2) - margin, min(y1, y2) - margin), (max(x1, x2), max(y1, y2))
    return _between(box, (low[0], low[1], high[0] + margin, high[1] + margin))


@kernel(error_model="numpy")
def _between(one, other):
    """Between two boxes, left, bottom, right, top, m; below 0 where they overlap."""
    x = max(one[0] - other[2], other[0] - one[2])
    y = max(one[1] - other[3], other[1] - one[3])
    return max(x, y)


@kernel(error_model="numpy")
def _distance(x, y, segments, i):
    """From a point to a segment, m."""
    x1, y1 = segments[i, 0], segments[i, 1]
    dx, dy = segments[i, 2] - x1, segments[i, 3] - y1
    along = ((x - x1) * dx + (y - y1) * dy) / (dx * dx + dy * dy)
    along = min(max(along, 0.0), 1.0)
    ax, ay = x - x1 - along * dx, y - y1 - along * dy
    return math.sqrt(ax * ax + ay * ay)


@kernel(error_model="numpy")
def _pull(rows, b, puller, impulses, parts):
    """The pivot joint: the body takes the velocity of what pulls it, as far as the force goes."""
    inverse, most = parts[b, INVERSE_MASS], parts[b, MAX_PULL]
    mass = inverse * (1.0 / (inverse * inverse))
    wanted_x, wanted_y = rows[puller, 3], rows[puller, 4]
    jx, jy = impulses[b, 0], impulses[b, 1]
    vx, vy = rows[b, 3] + jx * inverse, rows[b, 4] + jy * inverse
    for _ in range(ROUNDS):
        x, y = jx + mass * (wanted_x - vx), jy + mass * (wanted_y - vy)
        square = x * x + y * y
        if square > most * most:
            shrink = 1.0 / (math.sqrt(square) + SMALLEST)
            x, y = x * shrink * most, y * shrink * most
        dx, dy = x - jx, y - jy
        jx, jy = x, y
        if dx == 0.0 and dy == 0.0:
            break
        vx, vy = vx + dx * inverse, vy + dy * inverse
    rows[b, 3], rows[b, 4], impulses[b, 0], impulses[b, 1] = vx, vy, jx, jy


@kernel(error_model="numpy")
def _turn(rows, wheels, impulses, parts):
    """The gear joint: the robot turns as its wheels do, as far as their force goes."""
    inverse, most = parts[0, INVERSE_INERTIA], parts[0, MAX_TURN]
    inertia, wanted, j = 1.0 / inverse, rows[wheels, 5], impulses[0, 2]
    omega = rows[0, 5] + j * inverse
    for _ in range(ROUNDS):
        kept = min(max(j + (wanted - omega) * inertia, -most), most)
        change, j = kept - j, kept
        if change == 0.0:
            break
        omega += change * inverse
    rows[0, 5], impulses[0, 2] = omega, j
