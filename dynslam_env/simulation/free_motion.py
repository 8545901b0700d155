"""The bodies of a world while nothing touches anything: the same numbers as Chipmunk's, in a
fraction of the time.

Chipmunk solves all joints by ten rounds of impulses (Catto 2005, sequential impulses). Without
contacts no joint depends on another, and each is a few lines of arithmetic. Here they are written
in Chipmunk's order of operations, so that a world may pass from one to the other at any step.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dynslam_env.simulation.columns import (
    INVERSE_INERTIA,
    INVERSE_MASS,
    MAX_ANGLE,
    MAX_MOTOR,
    MAX_PULL,
    MAX_TURN,
    MIN_ANGLE,
    RADIUS,
    SIDE,
    WIDTH,
)
from dynslam_env.simulation.index_boxes import IndexBoxes, box_of, sort_in
from slam.geometry import Array
from slam.kernel import kernel

ROUNDS = 10  # of impulses in a physics step: Chipmunk's default
CLEARANCE = 1e-6  # m: nearer than that, Chipmunk looks whether two solids touch
SMALLEST = np.finfo(np.float64).tiny  # which Chipmunk adds to a length before it divides by it


class Bodies(NamedTuple):
    """The moving bodies of a world of d hung leaves and p people.

    rows      (1 + d + p + 1 + p, 6) x, y, angle, vx, vy, omega in m, rad, s: the robot, leaves,
              people, then what pulls them: the robot's wheels and the people's feet
    impulses  (1 + d + p, 3) of the joints in the last physics step: pull along x and y, N s, and
              turn, N m s, of the robot; those of motor and stop, N m s, of a leaf; pull of a person
    parts     (1 + d + p, 8) what does not change: see `columns`
    rates     (d,) rad/s, of the leaves' motors
    counts    (2,) d, p
    """

    rows: Array
    impulses: Array
    parts: Array
    rates: Array
    counts: NDArray[np.int64]


class Fixtures(NamedTuple):
    """What never moves.

    segments   (w, 4) m, walls and the edges of immovable leaves; rows after the first `count` of
               them are not looked at
    count      of segments
    margin     m, around each
    stop_bias  share of its overshoot by which a stop turns a leaf back in a physics step
    """

    segments: Array
    count: int
    margin: float
    stop_bias: float


@kernel
def move_freely(bodies: Bodies, index: IndexBoxes, fixtures: Fixtures, steps, dt):
    """Move the bodies by `steps` physics steps of `dt` s.

    False where any would touch; then none is moved.
    """
    rows, impulses, parts, rates, counts = bodies
    leaves, people = counts[0], counts[1]
    pairs = _pairs(bodies, fixtures, steps * dt)
    boxes, before, last, kept = index
    moved, pushed, sorted_in, count = rows, impulses, boxes, kept[0]
    if len(pairs):
        moved, pushed, sorted_in = rows.copy(), impulses.copy(), boxes.copy()
    left_box = False
    for _ in range(steps):
        before[count] = moved
        for b in range(len(moved)):
            for k in range(3):
                moved[b, k] += moved[b, 3 + k] * dt
        for m in range(len(pairs)):
            if _gap(pairs[m, 0], pairs[m, 1], moved, bodies, fixtures) < CLEARANCE:
                return False
        left_box = sort_in(moved, moved, parts, leaves, sorted_in)
        count += left_box
        for k in range(1 + people):
            b, puller = (0 if k == 0 else leaves + k), 1 + leaves + people + k
            _pull(moved[b], moved[puller], pushed[b], parts[b])
        _turn(moved[0], moved[1 + leaves + people], pushed[0], parts[0])
        for d in range(leaves):
            _swing(moved[1 + d], rates[d], pushed[1 + d], parts[1 + d], fixtures.stop_bias, dt)
    if len(pairs):
        rows[:], impulses[:], boxes[:] = moved, pushed, sorted_in
    last[:] = before[count - 1 if left_box else count]
    kept[0] = count
    return True


@kernel
def _pairs(bodies: Bodies, fixtures: Fixtures, duration):
    """(m, 2) the pairs that may touch within `duration` s: the row of the robot or of a person, and
    the segment from 0 on, or -1 - the row of a leaf or of another person."""
    rows, _, _, rates, counts = bodies
    leaves, people = counts[0], counts[1]
    discs = 1 + people
    pairs = np.empty((discs * (fixtures.count + leaves + discs), 2), dtype=np.int64)
    found = 0
    for k in range(discs):
        b = 0 if k == 0 else leaves + k
        reach = _travel(rows[b], rows[discs + leaves + k], duration) + CLEARANCE
        for s in range(fixtures.count):
            if _gap(b, s, rows, bodies, fixtures) < reach:
                pairs[found, 0], pairs[found, 1] = b, s
                found += 1
        for d in range(1, 1 + leaves):
            swept = reach + _sweep(rows[d], rates[d - 1], bodies.parts[d], duration)
            if _gap(b, -1 - d, rows, bodies, fixtures) < swept:
                pairs[found, 0], pairs[found, 1] = b, -1 - d
                found += 1
        for j in range(k):
            c = 0 if j == 0 else leaves + j
            met = reach + _travel(rows[c], rows[discs + leaves + j], duration)
            if _gap(b, -1 - c, rows, bodies, fixtures) < met:
                pairs[found, 0], pairs[found, 1] = b, -1 - c
                found += 1
    return pairs[:found]


@kernel
def _travel(body, puller, duration):
    """How far a body can come in `duration` s, m: it is never faster than it is and shall be."""
    speed = math.hypot(body[3], body[4]), math.hypot(puller[3], puller[4])
    return max(speed[0], speed[1]) * duration


@kernel
def _sweep(leaf, rate, part, duration):
    """How far the farthest corner of a leaf can come in `duration` s, m."""
    beyond = max(part[MIN_ANGLE] - leaf[2], leaf[2] - part[MAX_ANGLE], 0.0)
    turn = max(abs(leaf[5]), abs(rate)) * duration + beyond
    return turn * math.hypot(part[WIDTH], part[SIDE])


@kernel
def _gap(b, other, rows, bodies: Bodies, fixtures: Fixtures):
    """m between body `b`, a disc, and another solid, their margins included: see `_pairs`.

    The robot's from a segment is exact. Others are those between boxes: where boxes overlap,
    Chipmunk begins to search for the nearest corners, and begins with these the next time.
    """
    parts, leaves = bodies.parts, bodies.counts[0]
    if other < 0:
        c = -1 - other
        return _between(box_of(rows[b], parts[b], False),
                        box_of(rows[c], parts[c], 1 <= c <= leaves))  # fmt: skip
    wall, margin = fixtures.segments[other], fixtures.margin
    x1, y1, x2, y2 = wall[0], wall[1], wall[2], wall[3]
    if b == 0:
        return _distance(rows[b, 0], rows[b, 1], x1, y1, x2, y2) - margin - parts[b, RADIUS]
    low, high = (min(x1, x2) - margin, min(y1, y2) - margin), (max(x1, x2), max(y1, y2))
    box = low[0], low[1], high[0] + margin, high[1] + margin
    return _between(box_of(rows[b], parts[b], False), box)


@kernel
def _between(one, other):
    """Between two boxes, left, bottom, right, top, m; below 0 where they overlap."""
    x = max(one[0] - other[2], other[0] - one[2])
    y = max(one[1] - other[3], other[1] - one[3])
    return max(x, y)


@kernel
def _distance(x, y, x1, y1, x2, y2):
    """From a point to a segment, m."""
    dx, dy = x2 - x1, y2 - y1
    along = ((x - x1) * dx + (y - y1) * dy) / (dx * dx + dy * dy)
    along = min(max(along, 0.0), 1.0)
    return math.hypot(x - x1 - along * dx, y - y1 - along * dy)


@kernel
def _pull(body, puller, impulse, part):
    """The pivot joint: the body takes the velocity of what pulls it, as far as the force goes."""
    inverse, most = part[INVERSE_MASS], part[MAX_PULL]
    mass = inverse * (1.0 / (inverse * inverse))
    body[3] += impulse[0] * inverse
    body[4] += impulse[1] * inverse
    for _ in range(ROUNDS):
        x = impulse[0] + mass * (puller[3] - body[3])
        y = impulse[1] + mass * (puller[4] - body[4])
        square = x * x + y * y
        if square > most * most:
            shrink = 1.0 / (math.sqrt(square) + SMALLEST)
            x, y = x * shrink * most, y * shrink * most
        dx, dy = x - impulse[0], y - impulse[1]
        impulse[0], impulse[1] = x, y
        if dx == 0.0 and dy == 0.0:
            break
        body[3] += dx * inverse
        body[4] += dy * inverse


@kernel
def _turn(body, puller, impulse, part):
    """The gear joint: the robot turns as its wheels do, as far as their force goes."""
    inverse, most = part[INVERSE_INERTIA], part[MAX_TURN]
    inertia = 1.0 / inverse
    body[5] += impulse[2] * inverse
    for _ in range(ROUNDS):
        wanted = impulse[2] + (puller[5] - body[5]) * inertia
        kept = min(max(wanted, -most), most)
        change, impulse[2] = kept - impulse[2], kept
        if change == 0.0:
            break
        body[5] += change * inverse


@kernel
def _swing(leaf, rate, impulse, part, stop_bias, dt):
    """The motor of a leaf, and the stops at both ends of its way."""
    beyond = 0.0
    if leaf[2] > part[MAX_ANGLE]:
        beyond = part[MAX_ANGLE] - leaf[2]
    elif leaf[2] < part[MIN_ANGLE]:
        beyond = part[MIN_ANGLE] - leaf[2]
    bias = -stop_bias * beyond / dt
    if bias == 0.0:
        impulse[1] = 0.0
        if rate == 0.0 and leaf[5] == 0.0 and impulse[0] == 0.0:
            return
    inverse, most = part[INVERSE_INERTIA], part[MAX_MOTOR]
    inertia = 1.0 / inverse
    leaf[5] -= impulse[0] * inverse
    leaf[5] += impulse[1] * inverse
    for _ in range(ROUNDS):
        wanted = impulse[0] - (rate - leaf[5]) * inertia
        kept = min(max(wanted, -most), most)
        change, impulse[0] = kept - impulse[0], kept
        leaf[5] -= change * inverse
        held = 0.0
        if bias != 0.0:
            wanted = impulse[1] - (bias + leaf[5]) * inertia
            kept = max(wanted, 0.0) if bias < 0.0 else min(wanted, 0.0)
            held, impulse[1] = kept - impulse[1], kept
            leaf[5] += held * inverse
        if change == 0.0 and held == 0.0:
            break
