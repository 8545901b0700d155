"""Unpacking up to a bound: what somebody packed to fill our memory is refused."""

from __future__ import annotations

import bz2
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import IO, Protocol

import lz4.frame
from backports import zstd

from slam.errors import InputError

LARGEST = 1 << 27  # bytes of one chunk unpacked; recorders write chunks of 1 to 10 MB
ALL = 1 << 30  # bytes of all chunks of a recording, if it is more than
TIMES = 100  # times as large as packed; those that lie over each other are unpacked repeatedly

_left: ContextVar[list[int] | None] = ContextVar("left", default=None)


class _Unpacker(Protocol):
    @property
    def eof(self) -> bool | None: ...

    def decompress(self, data: bytes, max_length: int = ..., /) -> bytes: ...


@contextmanager
def bounded(packed: int) -> Iterator[None]:
    """While a recording of `packed` bytes is open, all of its chunks together are bounded too."""
    token = _left.set([max(ALL, TIMES * packed)])
    try:
        yield
    finally:
        _left.reset(token)


def as_it_is(data: bytes) -> bytes:
    """A chunk that is not packed. Raises InputError where all of them become too many."""
    return _counted(data)


def unpack_bz2(data: bytes) -> bytes:
    """Raises InputError for more than `LARGEST` bytes, OSError or EOFError for damaged ones."""
    return _counted(_unpacked(bz2.BZ2Decompressor(), data))


def unpack_lz4(data: bytes) -> bytes:
    """Raises InputError for more than `LARGEST` bytes, RuntimeError or EOFError for damaged."""
    return _counted(_unpacked(lz4.frame.LZ4FrameDecompressor(), data))


def unpack_zstd(data: bytes) -> bytes:
    """Raises InputError for more than `LARGEST` bytes, ZstdError or EOFError for damaged ones."""
    return _counted(_unpacked(zstd.ZstdDecompressor(), data))


def unpacking_zstd(file: IO[bytes], _: str) -> _Unpacking:
    """A file packed as a whole, open to be read."""
    return _Unpacking(zstd.ZstdFile(file, "rb"))


class _Unpacking:
    def __init__(self, file: zstd.ZstdFile) -> None:
        self._file = file

    def __enter__(self) -> _Unpacking:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def read(self, size: int) -> bytes:
        return _counted(self._file.read(min(size, LARGEST) if size >= 0 else LARGEST))


def _unpacked(unpacker: _Unpacker, data: bytes) -> bytes:
    unpacked = unpacker.decompress(data, LARGEST)
    if unpacker.eof:
        return unpacked
    if len(unpacked) < LARGEST:
        raise EOFError(f"a chunk of {len(data)} bytes ends early")
    raise InputError(f"a chunk of {len(data)} bytes unpacks to more than {LARGEST >> 20} MB")


def _counted(unpacked: bytes) -> bytes:
    left = _left.get()
    if left is not None:
        left[0] -= len(unpacked)
        if left[0] < 0:
            raise InputError("its chunks unpack to more than any recording holds")
    return unpacked
