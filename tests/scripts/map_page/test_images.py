# pyright: reportMissingImports=false
import base64
import io

import numpy as np
import pytest
from dynslam_cli.map_page import images
from dynslam_cli.map_page.images import (
    Picture,
    cropped,
    layers_picture,
    map_picture,
    small_enough,
)
from PIL import Image

from slam.grid import GridSpec, OccupancyGrid
from slam.io.layers import COLOURS
from slam.layers import Layers
from slam.layers.classification import CHANGING, FREE, KEPT, STATIC, UNKNOWN

COLOURED = ((200, 209, 222), (255, 255, 255), (0, 0, 0))


def picture(cells: np.ndarray, row0: int = 0, col0: int = 0) -> Picture:
    spec = GridSpec(0.5, row0, col0, *cells.shape)
    return Picture("map", "map", spec, cells.astype(np.uint8), COLOURED, [(2, "stands")])


def seen(png: str) -> np.ndarray:
    raw = base64.b64decode(png.removeprefix("data:image/png;base64,"))
    return np.asarray(Image.open(io.BytesIO(raw)).convert("RGB"))


def test_the_first_row_of_a_picture_is_the_top_and_only_what_was_seen_is_kept() -> None:
    cells = np.zeros((8, 6))
    cells[2, 1:5], cells[3, 1:3] = 1, 2
    told = picture(cells, row0=-4, col0=10).as_dict()
    assert told["extent"] == [5.5, 7.5, -1.0, 0.0]
    shown = seen(told["png"])
    expected = np.array(COLOURED)[[[2, 2, 0, 0], [1, 1, 1, 1]]]
    np.testing.assert_array_equal(shown, expected)


def test_nothing_seen_is_one_cell() -> None:
    assert cropped(picture(np.zeros((4, 4)))).cells.shape == (1, 1)


@pytest.mark.parametrize(("most", "fold"), [(4000, 1), (1000, 2), (999, 4), (65, 8)])
def test_a_wall_of_one_cell_stays_where_cells_are_joined(monkeypatch, most: int, fold: int) -> None:
    monkeypatch.setattr(images, "MAX_CELLS", most)
    cells = np.ones((50, 80))
    cells[:, 33] = 2
    small = small_enough(picture(cells, row0=-7, col0=3))
    assert small.spec.resolution == 0.5 * fold
    assert small.cells.size <= max(most, 4000 // fold**2 * 2)
    (wall,) = np.flatnonzero((small.cells == 2).all(axis=0))
    left = (small.spec.col0 + wall) * small.spec.resolution
    assert left <= (3 + 33) * 0.5 < left + small.spec.resolution


def test_map_and_layers_have_the_colours_of_their_legends() -> None:
    observed = np.array([[True, True, False]])
    grid = OccupancyGrid(GridSpec(0.1, 0, 0, 1, 3), np.array([[1.0, 0.0, 0.5]]), observed)
    assert map_picture(grid).cells.tolist() == [[2, 1, 0]]
    kind = np.array([[UNKNOWN, FREE, STATIC, KEPT, CHANGING, CHANGING]], np.uint8)
    share = np.array([[np.nan, np.nan, 1, 1, 0.02, 0.97]], np.float32)
    zeros = np.zeros_like(share)
    layers = Layers(GridSpec(0.1, 0, 0, 1, 6), kind, kind * 0, share, zeros, zeros, ())
    made = layers_picture(layers)
    shown = [made.colours[k] for k in made.cells[0]]
    names = ["free", "static", "kept", "seldom", "mostly"]
    assert shown[1:] == [COLOURS[name] for name in names]
    assert {made.colours[k] for k, _ in made.legend} >= set(shown)
    assert made.cells[0, 2] == max(made.cells[0])  # walls stay where cells are joined
