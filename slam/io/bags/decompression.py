"""Decompression up to a bound: a file made to fill the memory is refused."""

from __future__ import annotations

import bz2
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import IO, Protocol

import lz4.frame
from backports import zstd

from slam.errors import InputError

MAX_CHUNK = 1 << 27  # bytes of one chunk decompressed; recorders write chunks of 1 to 10 MB
SMALL_CHUNK = 1 << 24  # bytes that a chunk of any size may decompress to, and
MAX_CHUNK_RATIO = 50  # times its size
MAX_TOTAL = 1 << 30  # bytes of all chunks of a recording, if it is more than
MAX_RATIO = 100  # times its compressed size; overlapping chunks are decompressed repeatedly

_left: ContextVar[list[int] | None] = ContextVar("left", default=None)


class _Decompressor(Protocol):
    @property
    def eof(self) -> bool | None: ...

    def decompress(self, data: bytes, max_length: int = ..., /) -> bytes: ...


@contextmanager
def limited_decompression(packed: int) -> Iterator[None]:
    """Bound the sum of all chunks, too, while a recording of `packed` bytes is open."""
    token = _left.set([max(MAX_TOTAL, MAX_RATIO * packed)])
    try:
        yield
    finally:
        _left.reset(token)


def uncompressed(data: bytes) -> bytes:
    """A chunk that is not compressed. Raises InputError where all chunks together are too large."""
    return _counted(data)


def decompress_bz2(data: bytes) -> bytes:
    """Raises InputError for more than `MAX_CHUNK` bytes, OSError or EOFError for damaged ones."""
    return _counted(_decompressed(bz2.BZ2Decompressor(), data))


def decompress_lz4(data: bytes) -> bytes:
    """Raises InputError for more than `MAX_CHUNK` bytes, RuntimeError or EOFError for damaged."""
    return _counted(_decompressed(lz4.frame.LZ4FrameDecompressor(), data))


def decompress_zstd(data: bytes) -> bytes:
    """Raises InputError for more than `MAX_CHUNK` bytes, ZstdError or EOFError for damaged ones."""
    return _counted(_decompressed(zstd.ZstdDecompressor(), data))


def open_zstd(file: IO[bytes], _: str) -> _ZstdReader:
    """A compressed file, open for reading."""
    return _ZstdReader(zstd.ZstdFile(file, "rb"))


class _ZstdReader:
    def __init__(self, file: zstd.ZstdFile) -> None:
        self._file = file

    def __enter__(self) -> _ZstdReader:
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def read(self, size: int) -> bytes:
        return _counted(self._file.read(min(size, MAX_CHUNK) if size >= 0 else MAX_CHUNK))


def _decompressed(decompressor: _Decompressor, data: bytes) -> bytes:
    most = min(MAX_CHUNK, SMALL_CHUNK + MAX_CHUNK_RATIO * len(data))
    decompressed = decompressor.decompress(data, most)
    if decompressor.eof:
        return decompressed
    if len(decompressed) < most:
        raise EOFError(f"a chunk of {len(data)} bytes ends early")
    raise InputError(f"a chunk of {len(data)} bytes decompresses to more than {most >> 20} MB")


def _counted(decompressed: bytes) -> bytes:
    left = _left.get()
    if left is not None:
        left[0] -= len(decompressed)
        if left[0] < 0:
            raise InputError("its chunks decompress to more than any recording holds")
    return decompressed
