"""Fleet: the arrays of n robots with which a step computes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from dynslam_env.simulation.pointers import (
    flag_table,
    flags,
    integer_table,
    integers,
    single_table,
    table,
    tables,
    vector,
)
from slam.geometry import Array
from slam.kernel import kernel

Rows = NDArray[np.int64]


class Fleet(NamedTuple):
    """Arrays of the parts of a `WorldBatch`, each with a row per robot but for the settings.

    The wheels: see `DifferentialDrive`. Odometry: see `NoiseStreams`, `OdometrySensor`. Progress:
    see `TaskProgress`. Laser: see `raycast.look`.
    """

    scale: Array
    wheel_settings: Array
    poses: Array
    velocities: Array
    wheels: Array
    chords: Array
    speeds: Array
    rolled: Array
    bodies: Array
    before: Array
    noise: Array
    drawn: Array
    taken: Rows
    errors: Array
    displacements: Array
    odometry: NDArray[np.float32]
    fastest: Array
    heard: NDArray[np.float32]
    collided: NDArray[np.bool_]
    paths: Array
    legs: Rows
    at: Array
    arrived: NDArray[np.bool_]
    reach: Array
    kinds: Rows
    weights: Array
    ends: Rows
    terms: Array
    rewards: Array
    over: NDArray[np.bool_]
    laser: Array
    fan: Array
    ranges: Array
    scans: NDArray[np.float32]


@kernel
def fleet_of(pointers):
    """The `Fleet` to whose arrays, in its order, the `pointers` point."""
    p = pointers
    return Fleet(
        vector(p[0]), vector(p[1]), table(p[2]), table(p[3]), table(p[4]), table(p[5]),
        table(p[6]), table(p[7]), table(p[8]), table(p[9]), table(p[10]), tables(p[11], 3),
        integers(p[12]), vector(p[13]), table(p[14]), single_table(p[15]), vector(p[16]),
        single_table(p[17]), flags(p[18]), tables(p[19], 2), integer_table(p[20]), table(p[21]),
        flags(p[22]), vector(p[23]), integers(p[24]), vector(p[25]), integers(p[26]), table(p[27]),
        vector(p[28]), flag_table(p[29]), vector(p[30]), table(p[31]), table(p[32]),
        single_table(p[33]),
    )  # fmt: skip
