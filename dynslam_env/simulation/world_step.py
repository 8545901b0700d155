"""A control step of a world in which nothing touches anything, in one call of a kernel."""

from __future__ import annotations

from dynslam_env.simulation.bodies import (
    APART,
    FIXTURES,
    KEPT,
    LEAVES,
    MOST_COMMANDS,
    MOST_STEPS,
    NEXT_CONTROL,
    STEPS,
    bodies_of,
)
from dynslam_env.simulation.doors import drive
from dynslam_env.simulation.free_motion import move_freely
from dynslam_env.simulation.polygons import outline
from slam.kernel import kernel

CONTROL_DT = 0.1  # s, one step of the environment
SUBSTEPS = 10  # physics steps per control step
PHYSICS_DT = CONTROL_DT / SUBSTEPS
UNMOVED, CONTROLLED, FULL = 1, 2, 4  # bits: what remains to be done, see `World.finish_step`


@kernel(nogil=True, error_model="numpy")
def begin_step(memory, segments, doors, corners, first, speed, wheels):
    """Make a control step with the wheels at `wheels` (m/s, m/s, rad/s) as far as it needs no
    Chipmunk and no law; what remains to be done, as bits. The other arguments: see `settle`."""
    bodies, remains = bodies_of(memory), 0
    numbers, steps = bodies.numbers, int(memory[STEPS])
    puller = len(bodies.parts)
    for k in range(3):
        bodies.rows[puller, 3 + k] = bodies.commands[steps % MOST_COMMANDS, k] = wheels[k]
    if numbers[APART] != 0.0 and move_freely(bodies, segments, SUBSTEPS, PHYSICS_DT):
        settle(memory, segments, doors, corners, first, speed)
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
    bodies = bodies_of(memory)
    leaves, fixed = int(memory[LEAVES]), int(memory[FIXTURES])
    outline(bodies.rows[1 : len(bodies.parts)], first, corners, segments[fixed:])
    drive(bodies.rows[1 : 1 + leaves], CONTROL_DT, doors, speed, bodies.rates)
