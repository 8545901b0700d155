"""A control step of a world in which nothing touches anything, in one call of a kernel."""

from __future__ import annotations

import numpy as np

from dynslam_env.simulation.bodies import (
    APART,
    FIXTURES,
    KEPT,
    LEAVES,
    MOST_COMMANDS,
    MOST_STEPS,
    NEXT_CONTROL,
    STEPS,
    SUBSTEPS,
    Bodies,
    bodies_at,
)
from dynslam_env.simulation.doors import drive
from dynslam_env.simulation.free_motion import move_freely
from dynslam_env.simulation.polygons import outline
from dynslam_env.simulation.swinging import swing_ahead
from slam.kernel import kernel

CONTROL_DT = 0.1  # s, one step of the environment
PHYSICS_DT = CONTROL_DT / SUBSTEPS
UNMOVED, CONTROLLED, FULL = 1, 2, 4  # bits: what remains to be done, see `World.finish_step`


@kernel(nogil=True, error_model="numpy")
def begin_step(memory, segments, doors, corners, first, speed, wheels):
    """As `begin_swung` for a world by itself."""
    swing_ahead(np.array([memory.ctypes.data]), PHYSICS_DT)
    return begin_swung(memory, segments, doors, corners, first, speed, wheels)


@kernel(nogil=True, error_model="numpy")
def begin_swung(memory, segments, doors, corners, first, speed, wheels):
    """Make a control step with the wheels at `wheels` (m/s, m/s, rad/s) as far as it needs no
    Chipmunk and no law; what remains to be done, as bits. The other arguments: see `settle`.

    `swing_ahead` was called for the world, unless something touches something in it.
    """
    bodies, remains = bodies_at(memory.ctypes.data), 0
    numbers, steps = bodies.numbers, int(memory[STEPS])
    puller = len(bodies.parts)
    for k in range(3):
        bodies.rows[puller, 3 + k] = bodies.commands[steps % MOST_COMMANDS, k] = wheels[k]
    if numbers[APART] != 0.0 and move_freely(bodies, segments, PHYSICS_DT):
        _settle(bodies, segments, doors, corners, first, speed)
    else:
        remains |= UNMOVED
    steps += 1
    numbers[STEPS] = steps
    if numbers[NEXT_CONTROL] <= steps * CONTROL_DT:
        remains |= CONTROLLED
    if steps % MOST_COMMANDS == 0 or numbers[KEPT] + SUBSTEPS > MOST_STEPS:
        remains |= FULL
    return remains


@kernel(error_model="numpy")
def settle(memory, segments, doors, corners, first, speed):
    """Update the edges from the states of the bodies, and drive the doors for the next step.

    memory    of `Bodies`
    segments  (w + e, 4) m, what never moves, then the edges of the bodies, written
    doors     (5, d) table of `DoorMotors`
    corners, first  of `Polygons`
    speed     rad/s, full speed of a leaf
    """
    _settle(bodies_at(memory.ctypes.data), segments, doors, corners, first, speed)


@kernel(error_model="numpy")
def _settle(bodies: Bodies, segments, doors, corners, first, speed):
    leaves, fixed = int(bodies.numbers[LEAVES]), int(bodies.numbers[FIXTURES])
    outline(bodies.rows[1 : len(bodies.parts)], first, corners, segments[fixed:])
    drive(bodies.rows[1 : 1 + leaves], CONTROL_DT, doors, speed, bodies.rates)
