"""Tiles against a dictionary of cells."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slam.errors import InputError
from slam.maps.tiles import AREA, GROWTH, TILE, Tiles

RESOLUTION = 0.25
SIDE = TILE * RESOLUTION  # m, of a tile

coordinate = st.integers(-6400, 6400).map(lambda n: n / 64)  # on borders of tiles too
length = st.integers(0, 4000).map(lambda n: n / 64)
boxes = st.tuples(coordinate, coordinate, length, length)
steps = st.lists(st.tuples(boxes, st.integers(0, 2**32 - 1)), min_size=1, max_size=8)


class Naive:
    """A reference of tiles: a value per cell of the lattice, and an id that stays the same."""

    def __init__(self) -> None:
        self.values: dict[tuple[int, int], int] = {}
        self.ids: dict[tuple[int, int], int] = {}


def cell(tiles: Tiles, row: int, col: int) -> int:
    """The id of a cell of the lattice."""
    return tiles.cell(row - tiles.row0, col - tiles.col0)


def take_some(tiles: Tiles, rng: np.random.Generator) -> None:
    """Enter a few tiles of the index in a random order, as a tracer does; then allocate them."""
    free = np.argwhere(tiles.index == 0)
    used = tiles.used
    for row, col in rng.permutation(free)[:4]:
        tiles.index[row, col] = used
        used += 1
    tiles.allocate(used)


def write_some(tiles: Tiles, layer, naive: Naive, rng: np.random.Generator) -> None:
    for _ in range(10):
        place = tiles.places[rng.integers(1, tiles.used)]
        row, col = (place * TILE + rng.integers(0, TILE, 2)).tolist()
        number = int(rng.integers(1, 1000))
        layer.flat[cell(tiles, row, col)] = number
        naive.values[row, col] = number
        naive.ids[row, col] = cell(tiles, row, col)


@settings(max_examples=60)
@given(steps)
def test_cells_keep_their_ids_and_values_however_the_index_grows(moves) -> None:
    tiles, naive = Tiles(RESOLUTION), Naive()
    layer, pairs = tiles.layer(np.int32, 7), tiles.layer(np.float32, -1, (AREA, 2))
    for (x, y, width, height), seed in moves:
        rng = np.random.default_rng(seed)
        tiles.extend((x, y), (x + width, y + height))
        take_some(tiles, rng)
        if tiles.used > 1:
            write_some(tiles, layer, naive, rng)
        for (row, col), number in naive.values.items():
            assert cell(tiles, row, col) == naive.ids[row, col]
            assert layer.flat[naive.ids[row, col]] == number
        expected = np.full(tiles.spec.shape, 7)
        for (row, col), number in naive.values.items():
            expected[row - tiles.row0, col - tiles.col0] = number
        np.testing.assert_array_equal(tiles.dense(layer), expected)
        assert (tiles.dense(pairs) == -1).all()
        assert tiles.dense(pairs).shape == (*tiles.spec.shape, 2)
        assert (layer.values[0] == 7).all()


@settings(max_examples=60)
@given(steps)
def test_places_say_where_each_slot_lies(moves) -> None:
    tiles = Tiles(RESOLUTION)
    for (x, y, width, height), seed in moves:
        tiles.extend((x, y), (x + width, y + height))
        take_some(tiles, np.random.default_rng(seed))
        assert len(tiles.places) == tiles.used
        assert tiles.places.dtype == tiles.index.dtype == np.int32
        assert sorted(tiles.index[tiles.index > 0].tolist()) == list(range(1, tiles.used))
        assert tiles.corner == (tiles.row0 / TILE, tiles.col0 / TILE)
        for slot in range(1, tiles.used):
            assert tiles.index[tuple(tiles.places[slot] - tiles.corner)] == slot


@given(boxes, boxes)
def test_the_index_holds_the_box_in_whole_tiles_and_no_more_than_it_must(first, second) -> None:
    tiles = Tiles(RESOLUTION)
    x, y, width, height = first
    tiles.extend((x, y), (x + width, y + height))
    left, right, bottom, top = tiles.spec.extent
    assert left <= x < left + SIDE
    assert bottom <= y < bottom + SIDE
    assert right - SIDE <= x + width < right
    assert top - SIDE <= y + height < top
    assert tiles.origin == (left, bottom)
    before = tiles.spec
    x, y, width, height = second
    tiles.extend((x, y), (x + width, y + height))
    both = tiles.spec.extent
    assert both[0] == min(left, np.floor(x / SIDE) * SIDE)
    assert both[3] == max(top, np.floor((y + height) / SIDE) * SIDE + SIDE)
    again = tiles.index
    tiles.extend((left, bottom), (left + 0.1, bottom + 0.1))
    assert tiles.index is again
    assert before.resolution == tiles.spec.resolution == RESOLUTION


def test_covering_takes_no_tile_and_costs_no_layer() -> None:
    tiles = Tiles(0.05)
    layer = tiles.layer(np.float32)
    size = layer.values.nbytes
    tiles.extend((-300.0, -300.0), (300.0, 300.0))
    assert tiles.used == 1
    assert layer.values.nbytes == size
    assert tiles.nbytes == AREA * 4


def test_an_odometry_that_leaps_is_said_so_and_leaves_the_map_as_it_was() -> None:
    tiles = Tiles(0.05)
    tiles.extend((0.0, 0.0), (1.0, 1.0))
    before = tiles.spec
    for far in ((2e7, 0.0), (-1e5, 1e5)):
        with pytest.raises(InputError, match=r"does the odometry leap"):
            tiles.extend((min(far[0], 0), min(far[1], 0)), (max(far[0], 0), max(far[1], 0)))
        assert tiles.spec == before
    tiles.extend((0.0, 0.0), (600.0, 600.0))  # a hospital is no leap


def test_unused_cells_lie_in_the_blank_tile() -> None:
    tiles = Tiles(1.0)
    tiles.extend((0.0, 0.0), (200.0, 200.0))
    tiles.index[1, 2] = 1
    tiles.allocate(2)
    assert tiles.cell(TILE + 3, 2 * TILE + 5) == AREA + 3 * TILE + 5
    assert tiles.cell(3, 5) == 3 * TILE + 5
    assert tiles.places.tolist()[1] == [1, 2]


def test_a_layer_made_late_has_room_and_grows_like_the_others() -> None:
    tiles = Tiles(1.0)
    early = tiles.layer(np.uint8, 3)
    tiles.extend((0.0, 0.0), (64.0 * 63, 63.0))
    tiles.index[0, :40] = np.arange(1, 41)
    tiles.allocate(41)
    late = tiles.layer(np.float32, -1, (AREA, 2))
    small = tiles.layer(np.bool_, shape=(4,))
    for layer in (early, late, small):
        assert len(layer.values) >= 41
        assert (layer.values == layer.fill).all()
    late.flat[40 * AREA + 7] = (1.5, 2.5)
    tiles.index[0, 40:64] = np.arange(41, 65)
    tiles.allocate(65)
    assert late.flat[40 * AREA + 7].tolist() == [1.5, 2.5]
    assert (late.values != -1).sum() == 2
    assert tiles.nbytes == 65 * (AREA * 1 + AREA * 8 + 4)
    for layer in (early, late, small):
        assert 65 <= len(layer.values) <= GROWTH * 65


def test_dense_of_no_tiles_is_empty() -> None:
    tiles = Tiles(1.0)
    assert tiles.dense(tiles.layer(np.float32)).shape == (0, 0)
    assert tiles.dense(tiles.layer(np.int16, 0, (AREA, 2))).shape == (0, 0, 2)


@pytest.mark.parametrize(("dtype", "shape"), [(np.bool_, ()), (np.float32, ()), (np.uint8, (2,))])
def test_dense_has_every_cell_at_its_row_and_column(dtype, shape) -> None:
    tiles = Tiles(0.1)
    layer = tiles.layer(dtype, 0, (AREA, *shape))
    tiles.extend((-7.0, -1.0), (7.0, 8.0))
    tiles.index[0, 1], tiles.index[1, 0], tiles.index[1, 2] = 1, 2, 3
    tiles.allocate(4)
    layer.values[1:] = np.random.default_rng(0).integers(0, 2, layer.values[1:].shape)
    dense = tiles.dense(layer)
    assert dense.shape == (*tiles.spec.shape, *shape)
    for row, col in np.random.default_rng(1).integers(0, tiles.spec.shape, (300, 2)).tolist():
        np.testing.assert_array_equal(dense[row, col], layer.flat[tiles.cell(row, col)])
