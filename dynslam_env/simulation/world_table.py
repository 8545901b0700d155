# pyright: reportCallIssue=false
"""WorldTable: where the arrays of n worlds lie, so that one call of a kernel steps all of them.

A call of a kernel takes 0.2 us for each array. A world has a dozen.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic
from numba.np.numpy_support import carray
from numpy.typing import NDArray

from dynslam_env.sensors.laser import NO_DROPOUT, Scanner
from dynslam_env.sensors.raycast import look
from dynslam_env.simulation.bodies import LEAVES, PEOPLE, bodies_of
from dynslam_env.simulation.doors import DOOR_ROWS
from dynslam_env.simulation.world_step import step_freely
from slam.geometry import Array
from slam.kernel import kernel

if TYPE_CHECKING:
    from dynslam_env.simulation.world import World

Rows = NDArray[np.int64]

# columns: the address of each array of a world, and its length
MEMORY, SEGMENTS, DOORS, CORNERS, FIRST, NOISE, HITS, SIZES = 0, 1, 2, 3, 4, 5, 6, 7
FIRST_EDGE = 2 * SIZES
COLUMNS = FIRST_EDGE + 1


class WorldTable:
    """Addresses of the arrays of n worlds and of their scanners. A copy is empty.

    apart    (n,) bool, whether all of a world may be apart in the next step
    moved    (n,) bool, whether it was moved as such
    scans    (n,) row of the noise of the next scan
    """

    def __init__(self, n: int):
        self._addresses = np.zeros((n, COLUMNS), dtype=np.int64)
        self._bound: list[tuple[World, Scanner] | None] = [None] * n
        self.apart, self.moved = np.zeros(n, dtype=np.bool_), np.zeros(n, dtype=np.bool_)
        self.scans = np.zeros(n, dtype=np.int64)

    def __reduce__(self) -> tuple[type[WorldTable], tuple[int]]:
        """A copy's worlds lie elsewhere."""
        return WorldTable, (len(self._bound),)

    def bind(self, i: int, world: World, scanner: Scanner) -> None:
        """Let row `i` be this world, if it is not. (Other scanners than `Scanner` look alone.)"""
        if self._bound[i] is not None and self._bound[i] == (world, scanner):
            return
        self._bound[i] = world, scanner
        seen = (scanner.noise, scanner.hits) if type(scanner) is Scanner else ()
        arrays = *world.moving, *seen
        for k, array in enumerate(arrays):
            self._addresses[i, k], self._addresses[i, SIZES + k] = array.ctypes.data, array.size
        self._addresses[i, FIRST_EDGE] = world.first_edge

    def step(
        self, which: Rows, wheels: Array, robots: Array, speed: float, steps: int, dt: float
    ) -> None:
        """Move those worlds of `which` in which all is apart by `steps` physics steps of `dt` s.

        wheels  (n, 3) commanded velocities, m/s, m/s, rad/s
        robots  (n, 6) written: states of the robots that were moved
        speed   rad/s, full speed of leaves
        """
        _step(which, self._addresses, self.apart, self.moved, wheels, robots, speed, steps, dt)

    def look(
        self, which: Rows, scanner: Scanner, robots: Array, ranges: Array,
        observed: NDArray[np.float32],
    ) -> None:  # fmt: skip
        """Measure the scans of worlds `which`, whose scanners are all like `scanner`."""
        _look(which, self._addresses, self.scans, robots, scanner.settings, scanner.fan,
              NO_DROPOUT, ranges, observed)  # fmt: skip


@intrinsic
def _floats_at(typingctx, address):
    """A pointer to floats."""

    def codegen(context, builder, signature, args):
        return builder.inttoptr(args[0], ir.DoubleType().as_pointer())

    return types.CPointer(types.float64)(types.int64), codegen


@intrinsic
def _integers_at(typingctx, address):
    """A pointer to integers of 64 bits."""

    def codegen(context, builder, signature, args):
        return builder.inttoptr(args[0], ir.IntType(64).as_pointer())

    return types.CPointer(types.int64)(types.int64), codegen


@intrinsic
def _short_integers_at(typingctx, address):
    """A pointer to integers of 32 bits."""

    def codegen(context, builder, signature, args):
        return builder.inttoptr(args[0], ir.IntType(32).as_pointer())

    return types.CPointer(types.int32)(types.int64), codegen


@kernel
def _floats(row, k):
    """The array of column `k` of a row of the table."""
    return carray(_floats_at(row[k]), (row[SIZES + k],))


@kernel
def _table(row, k, columns):
    """The same with so many columns."""
    return carray(_floats_at(row[k]), (row[SIZES + k] // columns, columns))


@kernel(nogil=True, error_model="numpy")
def _step(which, addresses, apart, moved, wheels, robots, speed, steps, dt):
    for i in which:
        moved[i] = False
        row = addresses[i]
        memory = _floats(row, MEMORY)
        rows = bodies_of(memory).rows
        puller = 1 + int(memory[LEAVES]) + int(memory[PEOPLE])
        rows[puller, 3], rows[puller, 4] = wheels[i, 0], wheels[i, 1]
        rows[puller, 5] = wheels[i, 2]
        if not apart[i]:
            continue
        doors = carray(_floats_at(row[DOORS]), (DOOR_ROWS, row[SIZES + DOORS] // DOOR_ROWS))
        first = carray(_integers_at(row[FIRST]), (row[SIZES + FIRST],))
        segments, corners = _table(row, SEGMENTS, 4), _table(row, CORNERS, 2)
        moved[i] = step_freely(memory, segments, doors, corners, first, speed, steps, dt)
        robots[i] = rows[0]


@kernel(nogil=True, error_model="numpy")
def _look(which, addresses, scans, robots, settings, fan, lost, ranges, observed):
    beams = fan.shape[1]
    for i in which:
        row = addresses[i]
        noise, segments = _table(row, NOISE, beams), _table(row, SEGMENTS, 4)
        hits = carray(_short_integers_at(row[HITS]), (beams,))
        look(robots[i], settings, fan, segments, row[FIRST_EDGE], scans[i], noise, lost,
             ranges[i], observed[i], hits)  # fmt: skip
