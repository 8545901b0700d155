"""Archives that unpack to more than they say, and arrays that become longer lists than they may."""

import io
import tracemalloc
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from slam import DoorForecast, load_forecast, save_forecast
from slam.errors import InputError
from slam.io.archive import read_member
from slam.io.formats import read_log
from slam.io.layers import read_layers, write_layers
from slam.sessions.session import Session, session_of
from tests.slam.io.samples import small_drive
from tests.slam.layers.test_layers import doors

REAL = 32 << 20  # bytes that a member holds
ANNOUNCED = 10  # bytes that the archive says it has
MOST = 10e6  # bytes that reading it may take
LONG = 2_000_000  # numbers in an array


def understated(name: str, start: bytes, method: int) -> bytes:
    """An archive of one member: its checksum is right for the bytes that it says it has."""
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", method) as archive:
        archive.writestr(name, start + bytes(REAL - len(start)))
    raw = bytearray(file.getvalue())
    entry = raw.rfind(b"PK\x01\x02")
    raw[entry + 16 : entry + 20] = zlib.crc32((start + bytes(ANNOUNCED))[:ANNOUNCED]).to_bytes(
        4, "little"
    )
    raw[entry + 24 : entry + 28] = ANNOUNCED.to_bytes(4, "little")
    return bytes(raw)


def taken_by(read: Callable[[], object]) -> int:
    """Bytes at most that `read`, which is to be refused, takes."""
    tracemalloc.start()
    try:
        with pytest.raises(InputError):
            read()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize("method", [zipfile.ZIP_DEFLATED, zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
@pytest.mark.parametrize("start", [b"", np.lib.format.MAGIC_PREFIX])
def test_a_member_that_is_larger_than_it_says_is_refused(
    tmp_path: Path, method: int, start: bytes
) -> None:
    path = tmp_path / "some.npz"
    path.write_bytes(understated("format.npy", start, method))
    assert taken_by(lambda: load_forecast(path)) < MOST


def test_no_more_of_a_member_is_read_than_it_says(tmp_path: Path) -> None:
    data = understated("some", b"begin", zipfile.ZIP_DEFLATED)
    tracemalloc.start()
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        assert read_member(archive, "some", 1) == b"begin" + bytes(5)
    assert tracemalloc.get_traced_memory()[1] < MOST
    tracemalloc.stop()


def _session(path: Path) -> None:
    session_of(small_drive(), np.zeros((len(small_drive().scans), 3))).save(path)


@pytest.mark.parametrize(
    ("write", "read", "name", "values"),
    [
        (lambda path: save_forecast(DoorForecast(), path), load_forecast, "days", np.zeros(LONG)),
        (lambda path: save_forecast(DoorForecast(), path), load_forecast, "look", np.zeros(LONG)),
        (_session, Session.load, "limits", np.zeros((LONG // 3, 3))),
        (_session, Session.load, "mounts", np.zeros((LONG // 3, 3))),
        (_session, Session.load, "beam_times", np.zeros(LONG)),
        (
            lambda path: write_layers(doors(30, 60, 2), path),
            read_layers,
            "doors",
            np.zeros((LONG, 14), np.int8),
        ),
    ],
)
def test_no_list_is_made_of_an_array_that_is_too_long(
    tmp_path: Path, write: Callable[[Path], object], read: Callable[[Path], Any], name: str,
    values: np.ndarray,
) -> None:  # fmt: skip
    path = tmp_path / "some.npz"
    write(path)
    with np.load(path) as stored:
        arrays: dict[str, Any] = dict(stored)
    assert name in arrays
    np.savez_compressed(path, **(arrays | {name: values}))  # pyright: ignore[reportArgumentType]
    assert taken_by(lambda: read(path)) < 1.5 * values.nbytes + MOST


def test_a_recording_that_was_cut_off_is_called_so(tmp_path: Path) -> None:
    whole, torn = tmp_path / "whole.npz", tmp_path / "torn.npz"
    np.savez(whole, ranges=np.ones(1000))
    torn.write_bytes(whole.read_bytes()[:500])
    with pytest.raises(InputError, match=r"torn\.npz: .*its end is missing: it was cut off"):
        read_log(torn)
