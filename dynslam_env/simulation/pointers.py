# pyright: reportCallIssue=false
"""Pointers to arrays, by which one call of a kernel takes any number of them.

A call takes 0.06 us for each array that it is given, and as much for the numbers in a tuple.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic
from numba.np.numpy_support import carray
from numpy.typing import NDArray

from slam.kernel import kernel

ADDRESS, ROWS, COLUMNS, SIZE, WORDS = 0, 1, 2, 3, 4  # numbers of a pointer


def pointers_to(arrays: Iterable[NDArray[np.generic]]) -> NDArray[np.int64]:
    """(k, WORDS) of each array its address, length, elements per row and elements.

    The caller keeps the arrays. Raises ValueError for one with gaps.
    """
    return np.array([_pointer(array) for array in arrays], dtype=np.int64)


def _pointer(array: NDArray[np.generic]) -> tuple[int, int, int, int]:
    if not array.flags.c_contiguous:
        raise ValueError("an array with gaps has no pointer")
    columns = math.prod(array.shape[1:])
    return array.__array_interface__["data"][0], len(array), columns, array.size


def doubles_of(arrays: Iterable[NDArray[np.float64]]) -> NDArray[np.int64]:
    """Addresses of all elements of the arrays, one array after the other; the caller keeps them."""
    return np.concatenate([addresses_of(array) for array in arrays])


def addresses_of(array: NDArray[np.float64]) -> NDArray[np.int64]:
    """(size,) addresses of all elements of an array, row by row; the caller keeps it."""
    found = np.array([array.__array_interface__["data"][0]], dtype=np.int64)
    for length, stride in zip(array.shape, array.strides, strict=True):
        found = np.add.outer(found, stride * np.arange(length)).reshape(-1)
    return found


@intrinsic
def _doubles_at(typingctx, address):
    """A pointer to floats of 64 bits."""
    return types.CPointer(types.float64)(types.int64), _cast(ir.DoubleType())


@intrinsic
def _singles_at(typingctx, address):
    """A pointer to floats of 32 bits."""
    return types.CPointer(types.float32)(types.int64), _cast(ir.FloatType())


@intrinsic
def _longs_at(typingctx, address):
    """A pointer to integers of 64 bits."""
    return types.CPointer(types.int64)(types.int64), _cast(ir.IntType(64))


@intrinsic
def _ints_at(typingctx, address):
    """A pointer to integers of 32 bits."""
    return types.CPointer(types.int32)(types.int64), _cast(ir.IntType(32))


@intrinsic
def _bytes_at(typingctx, address):
    """A pointer to bytes: numba's truth values are of 1 bit."""
    return types.CPointer(types.uint8)(types.int64), _cast(ir.IntType(8))


def _cast(kind):
    def codegen(context, builder, signature, args):
        return builder.inttoptr(args[0], kind.as_pointer())

    return codegen


@kernel
def doubles(address, shape):
    """The array of floats at an address."""
    return carray(_doubles_at(address), shape)


@kernel
def vector(pointer):
    """(n,) the array of floats."""
    return carray(_doubles_at(pointer[ADDRESS]), (pointer[SIZE],))


@kernel
def table(pointer):
    """(n, k) the array of floats."""
    return carray(_doubles_at(pointer[ADDRESS]), (pointer[ROWS], pointer[COLUMNS]))


@kernel
def tables(pointer, columns):
    """(n, m, `columns`) the array of floats."""
    shape = pointer[ROWS], pointer[COLUMNS] // columns, columns
    return carray(_doubles_at(pointer[ADDRESS]), shape)


@kernel
def single_table(pointer):
    """(n, k) the array of floats of 32 bits."""
    return carray(_singles_at(pointer[ADDRESS]), (pointer[ROWS], pointer[COLUMNS]))


@kernel
def integers(pointer):
    """(n,) the array of integers."""
    return carray(_longs_at(pointer[ADDRESS]), (pointer[SIZE],))


@kernel
def integer_table(pointer):
    """(n, k) the array of integers."""
    return carray(_longs_at(pointer[ADDRESS]), (pointer[ROWS], pointer[COLUMNS]))


@kernel
def short_integers(pointer):
    """(n,) the array of integers of 32 bits."""
    return carray(_ints_at(pointer[ADDRESS]), (pointer[SIZE],))


@kernel
def flags(pointer):
    """(n,) the array of truth values, as bytes."""
    return carray(_bytes_at(pointer[ADDRESS]), (pointer[SIZE],))


@kernel
def flag_table(pointer):
    """(n, k) the array of truth values, as bytes."""
    return carray(_bytes_at(pointer[ADDRESS]), (pointer[ROWS], pointer[COLUMNS]))


@kernel
def copy_doubles(sources, targets):
    """Copy each float at one of the addresses `sources` to that of `targets`."""
    for k in range(len(sources)):
        carray(_doubles_at(targets[k]), (1,))[0] = carray(_doubles_at(sources[k]), (1,))[0]
