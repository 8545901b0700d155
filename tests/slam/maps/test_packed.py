import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slam.maps.packed import LONGEST, PackedLayer
from slam.maps.tiles import Tiles


@given(st.integers(0, 2**32 - 1), st.sampled_from([np.float32, np.uint8]))
def test_a_layer_comes_out_as_it_went_in(seed: int, dtype) -> None:
    rng = np.random.default_rng(seed)
    tiles = Tiles(0.1)
    layer, _ = tiles.layer(dtype, 7), tiles.layer(np.float64)
    tiles.extend((-9.0, 3.0), (12.0, 20.0))
    taken = rng.random(tiles.index.shape) < 0.4
    tiles.index[taken] = 1 + np.arange(taken.sum())
    tiles.allocate(1 + int(taken.sum()))
    layer.values[1:] = rng.integers(0, 200, layer.values[1:].shape)
    expected, spec = tiles.dense(layer), tiles.spec
    packed = PackedLayer(tiles, layer)
    layer.values[:], tiles.index[:] = 0, 0
    for _ in range(2):
        found, same = packed.unpacked()
        assert found.spec == spec
        assert same.fill == 7
        np.testing.assert_array_equal(found.dense(same), expected)
        assert found.nbytes == same.values.nbytes
        same.values[:] = 1


def test_what_is_the_same_everywhere_takes_little() -> None:
    tiles = Tiles(0.1)
    layer = tiles.layer(np.float32, 0.5)
    tiles.extend((0.0, 0.0), (40.0, 40.0))
    tiles.index[:] = 1 + np.arange(tiles.index.size).reshape(tiles.index.shape)
    tiles.allocate(1 + tiles.index.size)
    layer.values[5:] = 0.25
    assert len(layer.flat) > 2 * LONGEST
    packed = PackedLayer(tiles, layer)
    assert packed.nbytes == pytest.approx(0, abs=layer.values.nbytes / 500)
    np.testing.assert_array_equal(packed.unpacked()[1].values, layer.values)
