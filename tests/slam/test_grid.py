import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slam.errors import InputError
from slam.grid import TILE, GridSpec, grown

corner = st.tuples(st.floats(-40, 40), st.floats(-40, 40))
resolutions = st.sampled_from([0.05, 0.1, 0.25, 1.0])


def box(a, b):
    return (min(a[0], b[0]), min(a[1], b[1])), (max(a[0], b[0]), max(a[1], b[1]))


@given(corner, corner, resolutions)
def test_around_holds_the_box_in_whole_tiles(a, b, resolution: float) -> None:
    low, high = box(a, b)
    spec = GridSpec.around(low, high, resolution)
    left, right, bottom, top = spec.extent
    assert left <= low[0] + 1e-9
    assert high[0] < right + 1e-9
    assert bottom <= low[1] + 1e-9
    assert high[1] < top + 1e-9
    assert all(n % TILE == 0 for n in spec[1:])
    tile = TILE * resolution
    assert low[0] - left < tile + 1e-9
    assert right - high[0] < tile + 1e-9


@given(corner, corner, corner, corner, resolutions)
def test_growing_moves_no_cell(a, b, c, d, resolution: float) -> None:
    old = GridSpec.around(*box(a, b), resolution)
    new = old.covering(*box(c, d))
    values = np.arange(old.rows * old.cols).reshape(old.shape) + 1
    larger = grown(values, old, new, 0)
    rows = np.linspace(0, old.rows - 1, 5).astype(int)
    cells = np.column_stack([rows, np.linspace(0, old.cols - 1, 5).astype(int)])
    there = new.cells(old.centres(cells))
    assert (larger[there[:, 0], there[:, 1]] == values[cells[:, 0], cells[:, 1]]).all()
    assert larger.shape == new.shape
    assert np.count_nonzero(larger) == values.size


def test_a_box_within_changes_nothing() -> None:
    spec = GridSpec.around((-1, -1), (1, 1), 0.05)
    assert spec.covering((-0.5, 0.2), (0.9, 0.3)) == spec


@given(st.integers(-500, 500), st.integers(-500, 500), resolutions)
def test_cells_of_centres_are_the_cells(row: int, col: int, resolution: float) -> None:
    spec = GridSpec(resolution, -64, 128, 64, 64)
    assert spec.cells(spec.centres(np.array([[row, col]]))).tolist() == [[row, col]]


@given(st.floats(-50, 50), st.floats(-50, 50))
def test_a_point_lies_in_its_cell(x: float, y: float) -> None:
    spec = GridSpec(0.05, -64, 64, 128, 64)
    centre = spec.centres(spec.cells(np.array([[x, y]])))[0]
    assert abs(centre[0] - x) <= 0.025 + 1e-9
    assert abs(centre[1] - y) <= 0.025 + 1e-9


def test_x_grows_with_the_column_y_with_the_row_also_below_zero() -> None:
    spec = GridSpec(0.5, -64, -128, 192, 256)
    points = np.array([[-64.0, -32.0], [-0.1, -0.6], [0.0, 0.0], [63.9, 63.9]])
    assert spec.cells(points).tolist() == [[0, 0], [62, 127], [64, 128], [191, 255]]
    assert spec.origin == (-64.0, -32.0)
    assert spec.extent == (-64.0, 64.0, -32.0, 64.0)


@given(st.floats(-40, 40), st.floats(-40, 40), resolutions)
def test_the_cell_of_one_point_is_that_among_many(x: float, y: float, resolution: float) -> None:
    spec = GridSpec(resolution, -64, 128, 192, 256)
    assert list(spec.cell(x, y)) == spec.cells(np.array([[x, y]]))[0].tolist()


def test_layers_grow_with_their_cells_and_the_fill_is_given() -> None:
    old, new = GridSpec(1.0, 0, 0, 1, 1), GridSpec(1.0, -1, -2, 3, 4)
    larger = grown(np.array([[[1.0, 2.0]]], np.float32), old, new, math.nan)
    assert larger.shape == (3, 4, 2)
    assert larger.dtype == np.float32
    assert larger[1, 2].tolist() == [1.0, 2.0]
    assert np.isnan(larger).sum() == 22


def test_a_point_on_the_border_of_a_tile_has_a_cell_in_the_grid() -> None:
    spec = GridSpec.around((-16.0, 0.0), (16.0, 16.0), 0.25)
    assert (spec.row0, spec.col0, spec.rows, spec.cols) == (0, -64, 128, 192)
    assert spec.cells(np.array([[-16.0, 0.0], [16.0, 16.0]])).tolist() == [[0, 0], [64, 128]]


def test_a_grid_too_large_for_any_place_is_refused() -> None:
    spec = GridSpec.around((0, 0), (1, 1), 0.05)
    with pytest.raises(InputError, match="does the odometry leap"):
        spec.covering((0, 0), (1000, 1000))
