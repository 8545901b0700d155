"""A control step of a world in which nothing touches anything, in one call of a kernel."""

from __future__ import annotations

from dynslam_env.simulation.bodies import FIXTURES, LEAVES, bodies_of
from dynslam_env.simulation.doors import drive
from dynslam_env.simulation.free_motion import move_freely
from dynslam_env.simulation.polygons import outline
from slam.kernel import kernel


@kernel(nogil=True, error_model="numpy")
def step_freely(memory, segments, doors, corners, first, speed, steps, dt):
    """Move the bodies by `steps` physics steps of `dt` s, then `settle`.

    False where any would touch; then nothing is done.
    """
    moved = move_freely(bodies_of(memory), segments, steps, dt)
    if moved:
        settle(memory, segments, doors, corners, first, speed, steps * dt)
    return moved


@kernel(error_model="numpy")
def settle(memory, segments, doors, corners, first, speed, dt):
    """Update the edges from the states of the bodies, and drive the doors for the next `dt` s.

    memory    of `Bodies`
    segments  (w + e, 4) m, what never moves, then the edges of the bodies, written
    doors     (5, d) table of `DoorMotors`
    corners, first  of `Polygons`
    speed     rad/s, full speed of a leaf
    """
    bodies = bodies_of(memory)
    leaves, fixed = int(memory[LEAVES]), int(memory[FIXTURES])
    outline(bodies.rows[1 : len(bodies.parts)], first, corners, segments[fixed:])
    drive(bodies.rows[1 : 1 + leaves], dt, doors, speed, bodies.rates)
