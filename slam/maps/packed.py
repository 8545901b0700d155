"""Layers of maps that change no more, kept small."""

from __future__ import annotations

import zlib

import numpy as np

from slam.maps.tiles import Layer, TileIndex, Tiles

FAST = 1  # the level of compression; the best takes ten times as long for a tenth less


class PackedLayer:
    """One layer of a map's tiles as it is now, compressed without loss; the map may go.

    nbytes  that are kept
    """

    def __init__(self, tiles: Tiles, layer: Layer):
        self._resolution, self._used = tiles.resolution, tiles.used
        self._branch = TileIndex(tiles.row0, tiles.col0, tiles.index.copy())
        self._fill, self._dtype, self._shape = layer.fill, layer.values.dtype, layer.values.shape
        self._bytes = zlib.compress(layer.values.tobytes(), FAST)
        self.nbytes = len(self._bytes) + self._branch.index.nbytes

    def unpacked(self) -> tuple[Tiles, Layer]:
        """Tiles of their own with this layer alone."""
        tiles = Tiles(self._resolution)
        layer = tiles.layer(self._dtype, self._fill, self._shape[1:])
        tiles.switch(TileIndex(self._branch.row0, self._branch.col0, self._branch.index.copy()))
        tiles.take(self._used)
        values = np.frombuffer(zlib.decompress(self._bytes), self._dtype)
        layer.values[:] = values.reshape(self._shape)
        return tiles, layer
