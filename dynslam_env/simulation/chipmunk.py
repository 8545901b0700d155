# pyright: reportCallIssue=false
"""Calls of functions of the Chipmunk library from a kernel, without Python in between, and the
impulses that its joints keep from one physics step to the next.

The kernel gets the addresses of functions and objects from pymunk's cffi. It releases the GIL, so
that other threads can step other spaces. (numba passes the first argument of an intrinsic itself,
which pyright cannot know.)
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pymunk
from llvmlite import ir
from numba import types
from numba.extending import intrinsic
from numpy.typing import NDArray
from pymunk._chipmunk_cffi import ffi, lib
from pymunk.constraints import Constraint, GearJoint, PivotJoint, RotaryLimitJoint, SimpleMotor

from dynslam_env.simulation.bodies import KEPT, SEVERAL, Bodies
from dynslam_env.simulation.index_boxes import sort_in
from slam.geometry import Array
from slam.kernel import kernel

WORDS_OF_CONSTRAINT = 13  # of 8 bytes, at the beginning of every joint of Chipmunk
IMPULSE_WORDS = {  # of each kind of joint: where its impulse begins after these, and its numbers
    PivotJoint: (12, 2),
    GearJoint: (5, 1),
    SimpleMotor: (2, 1),
    RotaryLimitJoint: (4, 1),
}


def address(pointer: Any) -> int:
    """The address in a cffi pointer."""
    return int(ffi.cast("uintptr_t", pointer))


FUNCTION_ADDRESSES = tuple(
    address(ffi.addressof(lib, name))
    for name in (
        "cpSpaceStep", "cpSpaceEachBody", "pmSpaceBodyGetIteratorFuncBatched",
        "pmSpaceBodySetIteratorFuncBatched", "cpSpaceReindexShape",
    )
)  # fmt: skip


class BodyStates:
    """An array that Chipmunk fills with the states of a space's bodies, and takes them from.

    space  the pymunk space
    rows   (more than bodies, 6) x, y, angle, vx, vy, omega in m, rad, s of the bodies that are not
           static, in the order in which they were added; never full: Chipmunk would reallocate it
    """

    def __init__(self, space: pymunk.Space, rows: Array):
        self.space, self.rows = space, rows
        self._floats, self._batch = ffi.new("pmFloatArray *"), ffi.new("pmBatchedData *")
        self._floats.arr = ffi.cast("double *", self.rows.ctypes.data)
        self._floats.max = self.rows.size
        self._batch.floatArray = self._floats
        self._batch.fields = lib.POSITION | lib.ANGLE | lib.VELOCITY | lib.ANGULAR_VELOCITY
        count = ffi.offsetof("pmFloatArray", "num")
        self._written = np.frombuffer(ffi.buffer(self._floats), np.int32, count=1, offset=count)
        objects = address(space._space), address(self._batch)
        self._addresses = np.array([*FUNCTION_ADDRESSES, *objects], dtype=np.uintp)

    def advance(self, steps: int, dt: float) -> None:
        """Step the space `steps` times by `dt` s, and fill `rows`."""
        _advance(self._addresses, self._written, steps, dt)

    def place(self) -> None:
        """Put the bodies where `rows` says."""
        _place(self._addresses, self._written)

    def place_at(self, rows: Array, count: int, dt: float) -> None:
        """Put the first `count` bodies where `rows` says, and step once by `dt` s."""
        own = self.rows.copy()
        self.rows[:count] = rows[:count]
        _step_placed(self._addresses, self._written, dt)
        self.rows[:] = own

    def sort_in(self, bodies: Bodies, shapes: NDArray[np.uintp], count: int, dt: float) -> None:
        """Sort the `shapes` of the bodies into the space's index as `Bodies.who` and
        `Bodies.before` say, after physics steps of `dt` s elsewhere.

        shapes  (1 + d + p,) addresses of the shapes
        count   number of bodies that move, and of what pulls them
        """
        own = self.rows.copy()
        kept = int(bodies.numbers[KEPT])
        _sort_in(self._addresses, self._written, self.rows, bodies.before[:kept], bodies.who,
                 shapes, count, dt)  # fmt: skip
        self.rows[:] = own

    def advance_sorted(self, steps: int, dt: float, bodies: Bodies, leaves: int) -> None:
        """As `advance`, and follow the index of Chipmunk: see `index_boxes.sort_in`."""
        before = self.rows.copy()
        _advance_sorted(
            self._addresses, self._written, steps, dt, self.rows, before, bodies.parts, leaves,
            bodies.boxes,
        )  # fmt: skip


@kernel(nogil=True)
def _advance(addresses, written, steps, dt):
    step, each_body, read, _, _, space, batch = addresses
    for _ in range(steps):
        _step(step, space, dt)
    written[0] = 0
    _each_body(each_body, space, read, batch)


@kernel(nogil=True)
def _place(addresses, written):
    _, each_body, _, write, _, space, batch = addresses
    written[0] = 0
    _each_body(each_body, space, write, batch)


@kernel(nogil=True)
def _step_placed(addresses, written, dt):
    _place(addresses, written)
    _step(addresses[0], addresses[5], dt)


@kernel(nogil=True)
def _sort_in(addresses, written, rows, before, who, shapes, count, dt):
    for k in range(len(before)):
        rows[:count] = before[k, :count]
        if who[k] == SEVERAL:
            _step_placed(addresses, written, dt)
            continue
        b = int(who[k])
        for j in range(3):
            rows[b, j] += rows[b, 3 + j] * dt
        _place(addresses, written)
        _reindex(addresses[4], addresses[5], shapes[b])


@kernel(nogil=True)
def _advance_sorted(addresses, written, steps, dt, rows, before, parts, leaves, boxes):
    for _ in range(steps):
        before[:] = rows
        _advance(addresses, written, 1, dt)
        sort_in(rows, before, parts, leaves, boxes)


@intrinsic
def _step(typingctx, function, space, dt):
    """cpSpaceStep(space, dt)"""

    def codegen(context, builder, signature, args):
        kind = ir.FunctionType(ir.VoidType(), [args[1].type, args[2].type])
        builder.call(builder.inttoptr(args[0], kind.as_pointer()), args[1:])
        return context.get_dummy_value()

    return types.void(types.uintp, types.uintp, types.float64), codegen


@intrinsic
def _reindex(typingctx, function, space, shape):
    """cpSpaceReindexShape(space, shape)"""

    def codegen(context, builder, signature, args):
        kind = ir.FunctionType(ir.VoidType(), [arg.type for arg in args[1:]])
        builder.call(builder.inttoptr(args[0], kind.as_pointer()), args[1:])
        return context.get_dummy_value()

    return types.void(types.uintp, types.uintp, types.uintp), codegen


@intrinsic
def _each_body(typingctx, function, space, called, data):
    """cpSpaceEachBody(space, called, data)"""

    def codegen(context, builder, signature, args):
        kind = ir.FunctionType(ir.VoidType(), [arg.type for arg in args[1:]])
        builder.call(builder.inttoptr(args[0], kind.as_pointer()), args[1:])
        return context.get_dummy_value()

    return types.void(types.uintp, types.uintp, types.uintp, types.uintp), codegen


def impulse_of(joint: Constraint) -> Array:
    """The impulse of a joint in the last physics step, N s or N m s: a view of Chipmunk's memory.

    Chipmunk's interface gives its magnitude only. Raises RuntimeError where that is another.
    """
    first, count = IMPULSE_WORDS[type(joint)]
    at = ffi.cast("double *", joint._constraint) + WORDS_OF_CONSTRAINT + first
    impulse = np.frombuffer(ffi.buffer(at, 8 * count), np.float64)
    before, impulse[:] = impulse.copy(), (3.0, 4.0)[-count:]
    known = joint.impulse == (5.0 if count == 2 else 4.0)
    impulse[:] = before
    if not known:
        raise RuntimeError("Chipmunk keeps the impulses of joints where dynslam does not know")
    return impulse
