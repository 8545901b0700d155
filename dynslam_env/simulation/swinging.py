"""Leaves that nothing touches: their motors and stops, of all leaves together.

Motor and stop of a leaf push against each other by rounds of impulses (see `free_motion`), and
their last digits change in each round even where the leaf stands. A round waits for the one before
it; the rounds of other leaves, in this world and in others, are made meanwhile.
"""

from __future__ import annotations

import numpy as np

from dynslam_env.simulation.bodies import (
    DRIVEN,
    LEAVES,
    STOP_BIAS,
    STOPPED,
    SUBSTEPS,
    SWUNG_ROWS,
    bodies_at,
)
from dynslam_env.simulation.columns import INVERSE_INERTIA, MAX_ANGLE, MAX_MOTOR, MIN_ANGLE
from dynslam_env.simulation.pointers import doubles
from slam.kernel import kernel

ROUNDS = 10  # of impulses in a physics step: Chipmunk's default
LANES = 32  # leaves that are computed together: a processor is as fast for one

# numbers of a lane: rad, rad/s, N m s, N m s, rad/s, rad/s, 1/(kg m^2), kg m^2, N m s, rad, rad
ANGLE, OMEGA, MOTOR, STOP, BIAS, RATE, INVERSE, INERTIA, MOST, LOWEST, HIGHEST, NUMBERS = range(12)


@kernel(error_model="numpy")
def swing_ahead(memories, dt):
    """Write `Bodies.swung` for the next control step, of physics steps of `dt` s.

    memories  (n,) addresses of the memories of `Bodies`
    """
    lanes, swung = np.zeros((NUMBERS, LANES)), np.empty((SWUNG_ROWS, LANES))
    lanes[INVERSE] = lanes[INERTIA] = 1.0
    targets, strides = np.empty(LANES, np.int64), np.empty(LANES, np.int64)
    taken, stop_bias = 0, 0.0
    for memory in memories:
        bodies = bodies_at(memory)
        leaves, stop_bias = int(bodies.numbers[LEAVES]), bodies.numbers[STOP_BIAS]
        for k in range(leaves):
            _take(bodies.rows[1 + k], bodies.impulses[1 + k], bodies.parts[1 + k], lanes[:, taken])
            lanes[RATE, taken] = bodies.rates[k]
            targets[taken] = bodies.swung.ctypes.data + 8 * k
            strides[taken] = 8 * leaves
            taken += 1
            if taken == LANES:
                _swing(lanes.ctypes.data, swung.ctypes.data, stop_bias, dt)
                _give(swung, targets, strides, taken)
                taken = 0
    if taken:
        _swing(lanes.ctypes.data, swung.ctypes.data, stop_bias, dt)
        _give(swung, targets, strides, taken)


@kernel(error_model="numpy")
def _take(row, impulses, part, lane):
    lane[ANGLE], lane[OMEGA] = row[2], row[5]
    lane[MOTOR], lane[STOP] = impulses[0], impulses[1]
    lane[INVERSE], lane[INERTIA] = part[INVERSE_INERTIA], 1.0 / part[INVERSE_INERTIA]
    lane[MOST], lane[LOWEST], lane[HIGHEST] = part[MAX_MOTOR], part[MIN_ANGLE], part[MAX_ANGLE]


@kernel(error_model="numpy")
def _give(swung, targets, strides, count):
    for k in range(count):
        for row in range(SWUNG_ROWS):
            doubles(targets[k] + row * strides[k], (1,))[0] = swung[row, k]


@kernel(error_model="numpy")
def _swing(lanes_address, swung_address, stop_bias, dt):
    """A control step of all lanes. As the shapes are constant, the compiler knows that no row lies
    over another, and computes several lanes at once."""
    lanes = doubles(lanes_address, (NUMBERS, LANES))
    swung = doubles(swung_address, (SWUNG_ROWS, LANES))
    for step in range(SUBSTEPS):
        for k in range(LANES):
            angle = lanes[ANGLE, k] + lanes[OMEGA, k] * dt
            lowest, highest = lanes[LOWEST, k], lanes[HIGHEST, k]
            beyond = lowest - angle if angle < lowest else 0.0
            beyond = highest - angle if angle > highest else beyond
            bias = -stop_bias * beyond / dt
            stopped = lanes[STOP, k] if bias != 0.0 else 0.0
            omega = lanes[OMEGA, k] - lanes[MOTOR, k] * lanes[INVERSE, k]
            lanes[OMEGA, k] = omega + stopped * lanes[INVERSE, k]
            lanes[ANGLE, k], lanes[BIAS, k], lanes[STOP, k] = angle, bias, stopped
        for _ in range(ROUNDS):
            for k in range(LANES):
                omega, driven, stopped = lanes[OMEGA, k], lanes[MOTOR, k], lanes[STOP, k]
                inverse, inertia, most = lanes[INVERSE, k], lanes[INERTIA, k], lanes[MOST, k]
                bias = lanes[BIAS, k]
                kept = driven - (lanes[RATE, k] - omega) * inertia
                kept = -most if kept < -most else kept
                kept = most if kept > most else kept
                turned = omega - (kept - driven) * inverse
                held = stopped - (bias + turned) * inertia
                below, above = held if held > 0.0 else 0.0, held if held < 0.0 else 0.0
                held = below if bias < 0.0 else above
                stopping = turned + (held - stopped) * inverse
                lanes[OMEGA, k] = stopping if bias != 0.0 else turned
                lanes[MOTOR, k], lanes[STOP, k] = kept, held if bias != 0.0 else 0.0
        for k in range(LANES):
            swung[step, k] = lanes[OMEGA, k]
    for k in range(LANES):
        swung[DRIVEN, k], swung[STOPPED, k] = lanes[MOTOR, k], lanes[STOP, k]
