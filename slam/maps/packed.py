"""Compressed copies of the layers of maps that no longer change."""

from __future__ import annotations

import zlib

import numpy as np

from slam.kernel import kernel
from slam.maps.tiles import Layer, TileIndex, Tiles

COMPRESSION_LEVEL = 1  # zlib's fastest; the best takes ten times as long for a tenth less
LONGEST = np.iinfo(np.uint16).max  # cells of a run


class PackedLayer:
    """A compressed copy of one layer of a map's tiles, of one value a cell. Runs of equal values
    are stored, as most of a map is unknown or free. Nothing is lost but the sign of zeros.

    nbytes  size of the copy
    """

    def __init__(self, tiles: Tiles, layer: Layer):
        self._resolution, self._used = tiles.resolution, tiles.used
        self._index = TileIndex(tiles.row0, tiles.col0, tiles.index.copy())
        self._fill, self._shape = layer.fill, layer.values.shape[1:]
        values, lengths = _runs(layer.flat)
        self._types = values.dtype, lengths.dtype
        self._parts = [zlib.compress(part.data, COMPRESSION_LEVEL) for part in (values, lengths)]
        self.nbytes = sum(map(len, self._parts)) + self._index.index.nbytes

    def unpacked(self) -> tuple[Tiles, Layer]:
        """New tiles with this layer alone."""
        tiles = Tiles(self._resolution)
        layer = tiles.layer(self._types[0], self._fill, self._shape)
        tiles.switch(TileIndex(self._index.row0, self._index.col0, self._index.index.copy()))
        tiles.allocate(self._used)
        parts = zip(self._parts, self._types, strict=True)
        _write(layer.flat, *(np.frombuffer(zlib.decompress(part), kind) for part, kind in parts))
        return tiles, layer


@kernel
def _runs(cells):
    """The value of each run of equal cells, and its length, up to LONGEST."""
    values, lengths = np.empty_like(cells), np.empty(len(cells), np.uint16)
    n = begin = 0
    while begin < len(cells):
        value, end = cells[begin], begin + 1
        most = min(begin + LONGEST, len(cells))
        while end < most and cells[end] == value:
            end += 1
        values[n], lengths[n] = value, end - begin
        n, begin = n + 1, end
    return values[:n].copy(), lengths[:n].copy()


@kernel
def _write(cells, values, lengths):
    """Write runs to the cells."""
    begin = 0
    for k in range(len(values)):
        end = begin + lengths[k]
        cells[begin:end] = values[k]
        begin = end
