# pyright: reportMissingImports=false
"""Pictures of places from 5 m to 500 m: cut to what was seen, walls dark."""

import numpy as np
import pytest
from dynslam_cli.figures.canvas import MapCanvas
from dynslam_cli.figures.layer_cells import MOSTLY, SELDOM, STANDS, palette, ranked
from dynslam_cli.figures.layers_figure import layers_figure
from dynslam_cli.figures.map_panel import Box

from slam.grid import GridSpec
from slam.io.layers import COLOURS, picture
from slam.layers import Layers
from slam.layers.classification import CHANGING, FREE, KEPT, STATIC, UNKNOWN
from slam.layers.doors import MappedDoor

RESOLUTION = 0.05
SURE = MappedDoor(np.array([[1.0, 0.6], [1.0, 1.6]]), 0.5, 2, 9.0, 0.0, 9.0, 9, 9, 0.95)
PERHAPS = SURE._replace(probability=0.6, ends=SURE.ends + 0.5)


def place(width: float, height: float, doors: tuple[MappedDoor, ...] = ()) -> Layers:
    """A room with walls of one cell, and one in its middle, in a grid of twice its size."""
    rows, cols = round(height / RESOLUTION), round(width / RESOLUTION)
    kind = np.full((2 * rows, 2 * cols), UNKNOWN, np.uint8)
    room = kind[rows // 2 : rows // 2 + rows, cols // 2 : cols // 2 + cols]
    room[:] = FREE
    room[0] = room[-1] = room[:, 0] = room[:, -1] = room[rows // 2] = STATIC
    spec = GridSpec(RESOLUTION, -(rows // 2), -(cols // 2), *kind.shape)
    zeros = np.zeros(kind.shape, np.float32)
    return Layers(spec, kind, np.zeros_like(kind), zeros, zeros, zeros, doors)


def drawn(layers: Layers) -> tuple[np.ndarray, Box]:
    """(rows, cols, 3) pixels of the axes, and the part of the world that they show."""
    figure = layers_figure(layers, "a title")
    figure.canvas.draw()
    (axes,) = figure.axes
    x0, y0, x1, y1 = np.round(axes.get_window_extent().extents).astype(int)
    whole = np.asarray(figure.canvas.buffer_rgba())[::-1, :, :3]  # pyright: ignore
    return whole[y0 + 2 : y1 - 2, x0 + 2 : x1 - 2], Box(*axes.get_xlim(), *axes.get_ylim())


@pytest.mark.parametrize(("width", "height"), [(5.0, 4.0), (60.0, 80.0), (500.0, 30.0)])
def test_it_is_cut_to_what_was_seen_and_every_wall_is_black(width: float, height: float) -> None:
    pixels, box = drawn(place(width, height))
    assert box.width == pytest.approx(width, rel=0.3)
    assert box.left > -0.02 * max(width, 40.0)
    row, col = np.array(pixels.shape[:2]) // 2
    for line in (pixels[row // 2, :], pixels[:, 2 * col // 3]):  # across the walls
        black = (line < 40).all(axis=1)
        assert black.any()
    down = (pixels[:, 2 * col // 3] < 40).all(axis=1)
    walls = np.flatnonzero(np.diff(down.astype(int)) == 1)
    assert len(walls) == 3  # below, in the middle, above
    assert max(pixels.shape) < 4000


def test_doors_have_numbers_and_a_legend() -> None:
    figure = layers_figure(place(5.0, 4.0, (SURE, PERHAPS)), "a title")
    (axes,) = figure.axes
    assert axes.get_title() == "a title"
    words = [text.get_text() for text in axes.texts]
    assert words == ["1", "2", "1 m", "y"]
    legend = [text.get_text() for text in figure.legends[0].get_texts()]
    assert legend[-2:] == ["doors: 1", "perhaps doors: 1"]
    assert "always occupied" in legend


def test_the_numbers_of_cells_have_the_colours_of_the_layers() -> None:
    kind = np.array([[UNKNOWN, FREE, STATIC, KEPT, CHANGING, CHANGING]], np.uint8)
    share = np.array([[np.nan, np.nan, 1.0, 1.0, 0.0, 1.0]], np.float32)
    zeros = np.zeros_like(share)
    layers = Layers(GridSpec(0.1, 0, 0, 1, 6), kind, kind * 0, share, zeros, zeros, ())
    cells = ranked(layers)
    assert cells[0, [2, 4, 5]].tolist() == [STANDS, SELDOM, MOSTLY]
    np.testing.assert_array_equal(palette()[cells], picture(layers))
    assert tuple(palette()[STANDS]) == COLOURS["static"]


@pytest.mark.parametrize("width", [5.0, 60.0, 500.0])
def test_walls_of_a_film_are_dark(width: float) -> None:
    canvas = MapCanvas(Box(-1.0, width + 1.0, -1.0, 31.0), 800)
    canvas.grid(place(width, 30.0).static_map())
    pixels = np.asarray(canvas.finished().convert("L"))
    middle = pixels[pixels.shape[0] // 4 :, 400]
    assert middle.min() < 60
