"""A mutator: damaged bytes, hostile numbers and words, and the same inside of archives."""

from __future__ import annotations

import gzip
import io
import math
import random
import re
import zipfile
import zlib
from collections.abc import Callable, Iterator
from functools import lru_cache

import numpy as np

NUMBER = re.compile(rb"-?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
WORD = re.compile(rb"[\w./-]+|[\[\]{}(),:=#&*\"']")
NUMBERS = (
    b"0", b"-1", b"1e300", b"-1e300", b"1e10", b"1e-300", b"nan", b"inf", b"-inf", b"1e9", b"1e400",
    b"2147483648", b"9223372036854775808", b"-9223372036854775809", b"1" * 400, b"", b"true",
    b"null", b"\"1\"", b"[]", b"{}", b"0x10", b"1_0", b"1e", b"100000", b"0.5",
)  # fmt: skip
WORDS = (
    b"", b"[" * 3000, b"{" * 3000, b"(" * 300, b"\xff\xfe", b"\0", b"&a", b"*a", b"<<: *a", b"!!x",
    b"\n", b"\r", b"\t", b"# ", b"\"", b"'", b"---", b"nan", b"null", b"x" * 2000, b"\xc3\xa9",
    b"/dev/zero", b"..", b"__class__", b"dict(a=", b"time", b"lin_", b"\x1b[2J", b"\xe2\x80\xa8",
)  # fmt: skip
TEXT = bytes(range(127))
LONGEST = 60_000  # bytes of a mutation, or twice what was there
MOST_VALUES = 1_000_000  # of an array whose shape is changed
PNG = b"\x89PNG\r\n\x1a\n"
CHUNKS = (
    b"IHDR", b"PLTE", b"tRNS", b"gAMA", b"cHRM", b"sRGB", b"iCCP", b"pHYs", b"tEXt", b"zTXt",
    b"iTXt", b"eXIf", b"acTL", b"fcTL", b"fdAT", b"IDAT", b"IEND", b"aaaa", b"AAAA",
)  # fmt: skip
PACKED = (zipfile.ZIP_STORED, zipfile.ZIP_STORED, zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
VALUES = (0.0, -1.0, 1e300, -1e300, 1e10, 1e-300, np.nan, np.inf, -np.inf, 2.0**31, 2.0**63, 1e5)


def mutated(data: bytes, chance: random.Random) -> bytes:
    """`data` with one to eight changes."""
    longest = max(LONGEST, 2 * len(data))
    for _ in range(chance.choice([1, 1, 1, 2, 8])):
        data = _changed(data, chance)[:longest]
    return data


def _changed(data: bytes, chance: random.Random) -> bytes:
    ways: list[Callable[[bytes, random.Random], bytes]] = [damaged]
    if data.startswith(b"\x1f\x8b"):
        ways += [_in_gzip] * 3
    elif data.startswith(b"PK\x03\x04"):
        ways += [_in_zip] * 3
    elif data.startswith(PNG):
        ways += [_in_png] * 6
    elif data.startswith(b"\x93NUMPY"):
        ways += [_in_array] * 3
    elif len(data[:200].translate(None, TEXT)) < 10:
        ways += [_number, _number, _word, _line]
    return chance.choice(ways)(data, chance)


def damaged(data: bytes, chance: random.Random) -> bytes:
    """Bytes cut off, changed, put in, doubled, exchanged."""
    raw = bytearray(data or b"\0")
    a, b = sorted(chance.randrange(len(raw) + 1) for _ in range(2))
    at = min(a, len(raw) - 1)
    match chance.randrange(7):
        case 0:
            del raw[a:]
        case 1:
            raw[at] ^= 1 << chance.randrange(8)
        case 2:
            raw[at] = chance.choice([0, 1, 0x7F, 0x80, 0xFF])
        case 3:
            raw[a:a] = chance.randbytes(chance.randrange(1, 9))
        case 4:
            raw[a:a] = raw[a : min(b, a + 64)] * chance.choice([1, 1, 100])
        case 5:
            raw[a:b] = raw[a:b][::-1]
        case _:
            raw[at : at + 8] = chance.choice([b"\xff" * 8, b"\0" * 8, b"\xff" * 7 + b"\x7f"])
    return bytes(raw)


def _replaced(
    data: bytes, chance: random.Random, pattern: re.Pattern[bytes], by: tuple[bytes, ...]
) -> bytes:
    one = pattern.search(data, chance.randrange(len(data) + 1)) or pattern.search(data)
    if not one:
        return damaged(data, chance)
    return data[: one.start()] + chance.choice(by) + data[one.end() :]


def _number(data: bytes, chance: random.Random) -> bytes:
    return _replaced(data, chance, NUMBER, NUMBERS)


def _word(data: bytes, chance: random.Random) -> bytes:
    return _replaced(data, chance, WORD, WORDS)


def _line(data: bytes, chance: random.Random) -> bytes:
    """A line left out, doubled, moved, or many times."""
    lines = data.splitlines(keepends=True) or [b"\n"]
    at, to = chance.randrange(len(lines)), chance.randrange(len(lines) + 1)
    line = lines[at]
    match chance.randrange(3):
        case 0:
            del lines[at]
        case 1:
            lines.insert(to, line)
        case _:
            lines[to:to] = [line] * chance.choice([2, 100])
    return b"".join(lines)


def _in_gzip(data: bytes, chance: random.Random) -> bytes:
    try:
        return gzip.compress(_changed(gzip.decompress(data), chance), 1, mtime=0)
    except (OSError, EOFError, zlib.error):
        return damaged(data, chance)


def _in_zip(data: bytes, chance: random.Random) -> bytes:
    """One member changed, left out, renamed or put in again."""
    members = list(_members(data))
    if not members:
        return damaged(data, chance)
    at = chance.randrange(len(members))
    name, content = members[at]
    match chance.randrange(8):
        case 0:
            del members[at]
        case 1:
            members[at] = (chance.choice(members)[0], content)
        case 2:
            members.append((chance.choice(["x", "../x", name, "format.npy"]), content))
        case _:
            members[at] = (name, _changed(content, chance))
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", chance.choice(PACKED)) as packed:
        for name, content in members:
            packed.writestr(zipfile.ZipInfo(name), content)
    return file.getvalue()


@lru_cache(maxsize=64)
def _members(data: bytes) -> tuple[tuple[str, bytes], ...]:
    """Names and contents; none of an archive that was damaged before."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as packed:
            return tuple((one.filename, packed.read(one)) for one in packed.infolist())
    except Exception:
        return ()


def _in_png(data: bytes, chance: random.Random) -> bytes:
    """A chunk changed, left out, put in or renamed; the checksums are right."""
    chunks = list(_chunks(data)) or [(b"IEND", b"")]
    at, kind = chance.randrange(len(chunks)), chance.choice(CHUNKS)
    name, content = chunks[at]
    match chance.randrange(6):
        case 0:
            del chunks[at]
        case 1:
            chunks[at] = (kind, content)
        case 2:
            size = chance.choice([0, 1, 4, 8, 13, 26])
            chunks.insert(at, (kind, chance.choice([bytes(size), chance.randbytes(size)])))
        case _:
            chunks[at] = (name, damaged(content, chance))
    return PNG + b"".join(
        len(content).to_bytes(4, "big")
        + name
        + content
        + zlib.crc32(name + content).to_bytes(4, "big")
        for name, content in chunks
    )


def _chunks(data: bytes) -> Iterator[tuple[bytes, bytes]]:
    """Names and contents, as far as they are whole."""
    at = len(PNG)
    while at + 12 <= len(data):
        end = at + 8 + int.from_bytes(data[at : at + 4], "big")
        yield data[at + 4 : at + 8], data[at + 8 : end]
        at = end + 4


def _in_array(data: bytes, chance: random.Random) -> bytes:
    """Values, shape or type of an array changed."""
    try:
        array = np.load(io.BytesIO(data), allow_pickle=False)
    except Exception:  # damaged before
        return damaged(data, chance)
    match chance.randrange(5):
        case 0:
            shape = [chance.choice([0, 1, 2, 3, 100]) for _ in range(array.ndim)]
            array = np.resize(array, shape if math.prod(shape) <= MOST_VALUES else [0])
        case 1:
            kind = chance.choice(["i8", "u1", "f4", "f8", "U5", "S3", "?", "c16", "m8[s]", "u8"])
            with np.errstate(all="ignore"):
                array = np.zeros(array.shape, kind)
        case 2:
            array = array[..., None] if chance.random() < 0.5 else array.ravel()
        case _ if array.size and array.dtype.kind in "fiu":
            with np.errstate(all="ignore"):
                array = array.copy()
                array.flat[chance.randrange(array.size)] = _fitting(array, chance)
        case _:
            return damaged(data, chance)
    file = io.BytesIO()
    np.save(file, array, allow_pickle=False)
    return file.getvalue()


def _fitting(array: np.ndarray, chance: random.Random) -> float | int:
    value = chance.choice(VALUES)
    if array.dtype.kind == "f":
        return value
    limits = np.iinfo(array.dtype)
    return chance.choice([0, 1, int(limits.min), int(limits.max), 1000 & int(limits.max)])
