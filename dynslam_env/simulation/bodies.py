"""Bodies: the states and joints of the moving bodies of a world, in one array.

A kernel takes one array in a tenth of the time that it takes a dozen.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from dynslam_env.simulation.columns import COUNT
from dynslam_env.simulation.pointers import doubles
from slam.geometry import Array
from slam.kernel import kernel

SUBSTEPS = 10  # physics steps per control step
MOST_STEPS = 64  # physics steps that are kept, see `before`
MOST_COMMANDS = 64  # control steps of which the commands are kept
NOBODY, SEVERAL = -2, -1
STATE_SIZE = 6  # numbers of the state of a body
BOX_SIZE = 8

# numbers at the beginning of the array
LEAVES, PEOPLE, ROWS, KEPT, FIXTURES, FIXTURE_MARGIN, STOP_BIAS = 0, 1, 2, 3, 4, 5, 6
APART, STEPS, NEXT_CONTROL, HEADER = 7, 8, 9, 10

# rows of `swung` after one for each physics step
DRIVEN, STOPPED, SWUNG_ROWS = SUBSTEPS, SUBSTEPS + 1, SUBSTEPS + 2


class Bodies(NamedTuple):
    """The moving bodies of a world of d hung leaves and p people.

    numbers   (10,) d, p, number of rows, number of steps in `before`; of the fixtures their number,
              the margin around each, m, and the share of its overshoot by which a stop turns a leaf
              back in a physics step; whether (1 or 0) nothing touches anything, control steps
              so far, and the time from which on doors or people need another command, s
    rows      (1 + d + p + 1 + p or more, 6) x, y, angle, vx, vy, omega in m, rad, s: the robot,
              leaves, people, then what pulls them: the robot's wheels and the people's feet
    impulses  (1 + d + p, 3) of the joints in the last physics step: pull along x and y, N s, and
              turn, N m s, of the robot; those of motor and stop, N m s, of a leaf; pull of a person
    parts     (1 + d + p, 8) what does not change: see `columns`
    boxes     (1 + d + p, 8) see `index_boxes.sort_in`
    rates     (d,) rad/s, of the leaves' motors
    last      (rows, 6) the rows before the last physics step
    who       (MOST_STEPS + 1,) the body that left its box in a step that is kept, or SEVERAL
    before    (MOST_STEPS + 1, rows, 6) the rows before these steps
    swung     (12, d) of the leaves in a control step in which nothing touches them, see `swinging`:
              rad/s after each physics step, then the impulses of motor and stop, N m s, at the end
    commands  (MOST_COMMANDS, 3) of the wheels, m/s, m/s, rad/s, in the last control steps
    """

    numbers: Array
    rows: Array
    impulses: Array
    parts: Array
    boxes: Array
    rates: Array
    last: Array
    who: Array
    before: Array
    swung: Array
    commands: Array


def body_memory(leaves: int, people: int, spare_rows: int) -> Array:
    """Room for the `Bodies` of a world, all zero, with `spare_rows` more rows than bodies."""
    parts, rows = 1 + leaves + people, 2 + leaves + 2 * people + spare_rows
    states = rows * STATE_SIZE
    size = (
        HEADER
        + MOST_STEPS
        + 1
        + (MOST_STEPS + 3) * states
        + parts * (3 + COUNT + BOX_SIZE)
        + leaves * (1 + SWUNG_ROWS)
    )
    memory = np.zeros(size + 3 * MOST_COMMANDS)
    memory[:3], memory[APART] = (leaves, people, rows), 1.0
    return memory


@kernel(error_model="numpy")
def _begins(memory):
    """Where the arrays of `Bodies` begin in their memory, from the second on."""
    leaves, rows = int(memory[LEAVES]), int(memory[ROWS])
    parts, states = 1 + leaves + int(memory[PEOPLE]), rows * STATE_SIZE
    a = HEADER + states
    b = a + 3 * parts
    c = b + COUNT * parts
    d = c + BOX_SIZE * parts
    e = d + leaves
    f = e + states
    g = f + MOST_STEPS + 1
    h = g + (MOST_STEPS + 1) * states
    return a, b, c, d, e, f, g, h, h + SWUNG_ROWS * leaves


@kernel(error_model="numpy")
def bodies_of(memory):
    """`Bodies` that are views of their memory."""
    a, b, c, d, e, f, g, h, i = _begins(memory)
    leaves, rows, parts = int(memory[LEAVES]), int(memory[ROWS]), (b - a) // 3
    return Bodies(
        memory[:HEADER],
        memory[HEADER:a].reshape((rows, STATE_SIZE)),
        memory[a:b].reshape((parts, 3)),
        memory[b:c].reshape((parts, COUNT)),
        memory[c:d].reshape((parts, BOX_SIZE)),
        memory[d:e],
        memory[e:f].reshape((rows, STATE_SIZE)),
        memory[f:g],
        memory[g:h].reshape((MOST_STEPS + 1, rows, STATE_SIZE)),
        memory[h:i].reshape((SWUNG_ROWS, leaves)),
        memory[i:].reshape((MOST_COMMANDS, 3)),
    )


@kernel(error_model="numpy")
def bodies_at(address):
    """The same at the address of their memory, for a kernel that returns none of them: the views do
    not keep their memory. It takes a hundredth of the time."""
    memory, at = doubles(address, (HEADER,)), address
    a, b, c, d, e, f, g, h, i = _begins(memory)
    leaves, rows, parts = int(memory[LEAVES]), int(memory[ROWS]), (b - a) // 3
    return Bodies(
        doubles(at, (HEADER,)),
        doubles(at + 8 * HEADER, (rows, STATE_SIZE)),
        doubles(at + 8 * a, (parts, 3)),
        doubles(at + 8 * b, (parts, COUNT)),
        doubles(at + 8 * c, (parts, BOX_SIZE)),
        doubles(at + 8 * d, (leaves,)),
        doubles(at + 8 * e, (rows, STATE_SIZE)),
        doubles(at + 8 * f, (MOST_STEPS + 1,)),
        doubles(at + 8 * g, (MOST_STEPS + 1, rows, STATE_SIZE)),
        doubles(at + 8 * h, (SWUNG_ROWS, leaves)),
        doubles(at + 8 * i, (MOST_COMMANDS, 3)),
    )
