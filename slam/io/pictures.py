"""Grey pictures of maps: binary PGM, and what picture editors make of it (plain PGM, PNG, BMP)."""

from __future__ import annotations

import os
import re
import struct
import warnings
from pathlib import Path

import numpy as np
from PIL import Image

from slam.errors import InputError
from slam.io.arrays import UNREADABLE
from slam.io.files import reading
from slam.io.guard import take
from slam.io.one_line import one_line

MAX_HEADER = 1 << 16  # bytes, comments and all
MAX_PIXELS = 1 << 28
PIXEL_BYTES = 40  # of a pixel: as floats, its probability, and what it is compared with
HEADER = re.compile(
    rb"P5(?:\s|#[^\n]*\n)+(\d{1,9})(?:\s|#[^\n]*\n)+(\d{1,9})(?:\s|#[^\n]*\n)+(\d{1,5})\s"
)
EDITED = {b"P2": "PPM", b"\x89PNG": "PNG", b"BM": "BMP"}  # first bytes: the format's name
CHANNELS = {"1": "L", "L": "L", "LA": "LA", "P": "RGB", "RGB": "RGB", "RGBA": "RGBA"}


def read_picture(path: Path) -> np.ndarray:
    """(rows, cols) uint8: how bright each pixel is, 0 black to 255 white; the mean of the colours,
    as nav2's map_server takes it. Raises InputError for any other file."""
    with reading(path) as file:
        head = file.read(8)
    for magic, kind in EDITED.items():
        if head.startswith(magic):
            return _edited(path, kind)
    return _binary_pgm(path)


def _edited(path: Path, kind: str) -> np.ndarray:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of a large picture; of frames of an animation
            with Image.open(path, formats=(kind,)) as picture:
                return _brightness(path, picture)
    except InputError:
        raise
    except (*UNREADABLE, struct.error, Image.DecompressionBombError) as error:
        raise InputError(f"{path}: cannot be read as a picture ({one_line(error)})") from None


def _brightness(path: Path, picture: Image.Image) -> np.ndarray:
    width, height = picture.size
    if width * height > MAX_PIXELS:
        raise InputError(f"{path}: {width} x {height} pixels are more than any map has")
    if picture.mode not in CHANNELS:
        raise InputError(f"{path}: expected a picture with 8 bits a colour, got {picture.mode}")
    take(PIXEL_BYTES * width * height)
    pixels = np.asarray(picture.convert(CHANNELS[picture.mode]), dtype=np.float64)
    if pixels.ndim == 2:
        return pixels.astype(np.uint8)
    colours = 1 if pixels.shape[2] == 2 else 3
    return np.rint(pixels[:, :, :colours].mean(axis=2)).astype(np.uint8)


def _binary_pgm(path: Path) -> np.ndarray:
    with reading(path) as file:
        header = HEADER.match(file.read(MAX_HEADER))
        if not header or header[3] != b"255":
            raise InputError(f"{path}: expected a binary PGM (P5) with 8 bits a pixel")
        cols, rows = int(header[1]), int(header[2])
        held = file.seek(0, os.SEEK_END) - header.end()
        if not rows * cols or held != rows * cols:
            raise InputError(f"{path}: expected {cols} x {rows} pixels, got {held} bytes of them")
        if held > MAX_PIXELS:
            raise InputError(f"{path}: {cols} x {rows} pixels are more than any map has")
        take(PIXEL_BYTES * held)
        file.seek(header.end())
        return np.frombuffer(file.read(), dtype=np.uint8).reshape(rows, cols)
