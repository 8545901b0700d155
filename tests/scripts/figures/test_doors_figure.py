# pyright: reportMissingImports=false
from dataclasses import replace

import numpy as np
from dynslam_cli.figures.doors_figure import COLUMNS, GAP, PANEL, TITLE, doors_picture
from PIL import ImageColor

from slam.geometry import Pose2
from slam.layers import layers
from slam.layers.classification import STATIC
from slam.layers.doors import MappedDoor
from tests.slam.layers.rooms import HOUSE, watch

DOOR = MappedDoor(np.array([[-0.45, 1.0], [0.45, 1.0]]), 0.5, 2, 9.0, 0.0, 9.0, 9, 9, 0.95)
PERHAPS = DOOR._replace(probability=0.6, ends=DOOR.ends + (5.0, 0.0))


def test_each_door_is_drawn_with_what_is_around_it() -> None:
    made = layers(*watch([HOUSE] * 20, [Pose2(x, 0.0, 0.0) for x in np.linspace(-1, 1, 20)]))
    made = replace(made, doors=(DOOR,) * COLUMNS + (PERHAPS,))
    pixels = np.asarray(doors_picture(made))
    assert pixels.shape == (
        GAP + 2 * (PANEL + TITLE + GAP), GAP + COLUMNS * (PANEL + GAP), 3
    )  # fmt: skip
    first = pixels[GAP + TITLE : GAP + TITLE + PANEL, GAP : GAP + PANEL]
    sure = (first == ImageColor.getrgb("#0050d0")).all(axis=2)
    rows, cols = np.nonzero(sure)
    assert abs(rows.mean() - PANEL / 2) < 2
    assert abs(cols.max() - cols.min() - 0.9 * PANEL / 4.0) < 4
    wall = (first == 0).all(axis=2)  # y = 1.01: the row of the door, to both sides
    row = int(PANEL / 2)
    assert wall[row - 2 : row + 3, :60].any()
    assert not wall[row + 12 : row + 60, 70:130].any()  # free before it
    second = pixels[GAP + TITLE + PANEL + GAP :]
    assert (second == ImageColor.getrgb("#4a90e2")).all(axis=2).sum() > 50
    assert (made.kind == STATIC).any()
