"""Compressed copies of the layers of maps that no longer change."""

from __future__ import annotations

import zlib

import numpy as np

from slam.maps.tiles import Layer, TileIndex, Tiles

COMPRESSION_LEVEL = 1  # zlib's fastest; the best takes ten times as long for a tenth less


class PackedLayer:
    """A lossless compressed copy of one layer of a map's tiles.

    nbytes  size of the copy
    """

    def __init__(self, tiles: Tiles, layer: Layer):
        self._resolution, self._used = tiles.resolution, tiles.used
        self._index = TileIndex(tiles.row0, tiles.col0, tiles.index.copy())
        self._fill, self._dtype, self._shape = layer.fill, layer.values.dtype, layer.values.shape
        self._bytes = zlib.compress(layer.values.tobytes(), COMPRESSION_LEVEL)
        self.nbytes = len(self._bytes) + self._index.index.nbytes

    def unpacked(self) -> tuple[Tiles, Layer]:
        """New tiles with this layer alone."""
        tiles = Tiles(self._resolution)
        layer = tiles.layer(self._dtype, self._fill, self._shape[1:])
        tiles.switch(TileIndex(self._index.row0, self._index.col0, self._index.index.copy()))
        tiles.allocate(self._used)
        values = np.frombuffer(zlib.decompress(self._bytes), self._dtype)
        layer.values[:] = values.reshape(self._shape)
        return tiles, layer
