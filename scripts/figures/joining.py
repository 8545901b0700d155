"""Cells of a map joined to larger ones, so that a picture has few of them and thin walls stay."""

from __future__ import annotations

import math

import numpy as np

from slam.grid import GridSpec


def fold_for(cell: float, pixel: float) -> int:
    """By how many cells of a side `cell`, m, larger ones are made that are at least `pixel`, m: a
    power of two."""
    return 2 ** max(math.ceil(math.log2(pixel / cell) - 1e-9), 0)


def blocks(first: int, count: int, fold: int) -> list[int]:
    """Offsets at which blocks of `fold` cells begin, in `count` cells from number `first` on."""
    return [0, *range(fold - first % fold, count, fold)]


def coarse(spec: GridSpec, fold: int) -> GridSpec:
    """The grid of the joined cells."""
    rows, cols = blocks(spec.row0, spec.rows, fold), blocks(spec.col0, spec.cols, fold)
    return GridSpec(
        spec.resolution * fold, spec.row0 // fold, spec.col0 // fold, len(rows), len(cols)
    )


def cut(
    spec: GridSpec, cells: np.ndarray, box: tuple[float, float, float, float]
) -> tuple[GridSpec, np.ndarray]:
    """The part of cells (rows, cols, ...) around a box (left, right, bottom, top), m, and its
    grid: of a map that stray beams made large, a picture shows little."""
    left, right, bottom, top = box
    low, high = spec.cells(np.array([(left, bottom), (right, top)]))
    (row0, col0), (row1, col1) = np.maximum(low - 1, 0).tolist(), (high + 2).tolist()
    part = cells[row0:row1, col0:col1]
    rows, cols = part.shape[:2]
    whole = GridSpec(spec.resolution, spec.row0 + row0, spec.col0 + col0, rows, cols)
    return whole, part


def joined(spec: GridSpec, cells: np.ndarray, fold: int) -> tuple[GridSpec, np.ndarray]:
    """Cells (rows, cols) joined by fold x fold to the highest of each, and their grid."""
    if fold == 1:
        return spec, cells
    high = np.maximum.reduceat(cells, blocks(spec.row0, spec.rows, fold), axis=0)
    high = np.maximum.reduceat(high, blocks(spec.col0, spec.cols, fold), axis=1)
    return coarse(spec, fold), high
