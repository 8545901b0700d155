# pyright: reportCallIssue=false
"""Calls of functions of the Chipmunk library from a kernel, without Python in between.

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
from pymunk._chipmunk_cffi import ffi, lib

from slam.kernel import kernel

STATE_SIZE = 6  # numbers of the state of a body


def address(pointer: Any) -> int:
    """The address in a cffi pointer."""
    return int(ffi.cast("uintptr_t", pointer))


FUNCTION_ADDRESSES = tuple(
    address(ffi.addressof(lib, name))
    for name in ("cpSpaceStep", "cpSpaceEachBody", "pmSpaceBodyGetIteratorFuncBatched")
)


class BodyStates:
    """An array that Chipmunk fills with the states of a space's bodies.

    space  the pymunk space
    rows   (bodies, 6) x, y, angle, vx, vy, omega in m, rad, s of the bodies that are not static, in
           the order in which they were added
    """

    def __init__(self, space: pymunk.Space):
        self.space = space
        self.rows = np.zeros(
            (len(space.bodies) + 2, STATE_SIZE)
        )  # never full: Chipmunk would reallocate it
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


@kernel(nogil=True)
def _advance(addresses, written, steps, dt):
    step, each_body, read, space, batch = addresses
    for _ in range(steps):
        _step(step, space, dt)
    written[0] = 0
    _each_body(each_body, space, read, batch)


@intrinsic
def _step(typingctx, function, space, dt):
    """cpSpaceStep(space, dt)"""

    def codegen(context, builder, signature, args):
        kind = ir.FunctionType(ir.VoidType(), [args[1].type, args[2].type])
        builder.call(builder.inttoptr(args[0], kind.as_pointer()), args[1:])
        return context.get_dummy_value()

    return types.void(types.uintp, types.uintp, types.float64), codegen


@intrinsic
def _each_body(typingctx, function, space, called, data):
    """cpSpaceEachBody(space, called, data)"""

    def codegen(context, builder, signature, args):
        kind = ir.FunctionType(ir.VoidType(), [arg.type for arg in args[1:]])
        builder.call(builder.inttoptr(args[0], kind.as_pointer()), args[1:])
        return context.get_dummy_value()

    return types.void(types.uintp, types.uintp, types.uintp, types.uintp), codegen
