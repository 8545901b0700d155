# pyright: reportMissingImports=false
import tracemalloc
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from dynslam_cli.console.output import write_png
from dynslam_cli.figures.map_figure import map_figure, overview_figure
from dynslam_cli.figures.map_panel import MapPanel, coarser
from PIL import Image

from slam.grid import GridSpec, OccupancyGrid


@pytest.mark.parametrize(
    ("pixel", "fold"), [(0.01, 1), (0.05, 1), (0.06, 2), (0.1, 2), (0.5, 16), (3.2, 64)]
)
@pytest.mark.parametrize("spec", [GridSpec(0.05, -64, 192, 128, 64), GridSpec(0.05, -3, 5, 70, 9)])
def test_thin_walls_and_single_sights_stay(spec: GridSpec, pixel: float, fold: int) -> None:
    rng = np.random.default_rng(1)
    observed = rng.random(spec.shape) < 0.02
    grid = OccupancyGrid(spec, rng.random(spec.shape), observed)
    small = coarser(grid, pixel)
    assert small.spec.resolution == pytest.approx(0.05 * fold)
    expected: dict[tuple[int, int], list[float]] = {}
    for row, col in np.argwhere(observed).tolist():
        block = (row + spec.row0) // fold, (col + spec.col0) // fold
        expected.setdefault(block, []).append(float(grid.occupied[row, col]))
    for row in range(small.spec.rows):
        for col in range(small.spec.cols):
            seen = expected.pop((row + small.spec.row0, col + small.spec.col0), [])
            assert small.observed[row, col] == bool(seen)
            told = max(seen) if max(seen, default=0) > 0.5 else sum(seen) / max(len(seen), 1)
            assert not seen or small.occupied[row, col] == pytest.approx(told)
    assert not expected


def walled(side: int, step: int = 97) -> OccupancyGrid:
    """A free square of `side` cells, with walls of one cell every `step` cells."""
    occupied = np.zeros((side, side))
    occupied[::step] = occupied[:, ::step] = 1.0
    spec = GridSpec(0.05, -side // 2, -side // 2, side, side)
    return OccupancyGrid(spec, occupied, np.ones((side, side), dtype=bool))


def shades(figure, tmp_path: Path) -> np.ndarray:
    write_png(figure, tmp_path / "map.png")
    with Image.open(tmp_path / "map.png") as picture:
        return np.asarray(picture.convert("L"))


@pytest.mark.parametrize("side", [300, 1000, 2000, 2500, 5000])
def test_a_wall_of_one_cell_is_black_at_any_size(side: int, tmp_path: Path) -> None:
    picture = shades(map_figure(walled(side)), tmp_path)
    middle = picture[picture.shape[0] // 2 - 100 : picture.shape[0] // 2 + 100]
    walls = -(-side // 97)
    black = (middle < 50).mean(axis=0) > 0.99  # columns of pixels of walls
    assert np.count_nonzero(black[1:] & ~black[:-1]) == walls
    assert np.median(middle) > 250  # and what is free stays white


def test_a_wall_of_one_cell_is_black_beside_other_maps(tmp_path: Path) -> None:
    panels = [MapPanel("", walled(2000)), MapPanel("", walled(1000))]
    picture = shades(overview_figure(panels), tmp_path)
    line = (picture < 50).mean(axis=0) > 0.3
    assert np.count_nonzero(line[1:] & ~line[:-1]) > 20


def test_the_memory_to_draw_a_map_does_not_grow_with_the_map() -> None:
    cells = 10_000, 10_000  # 800 MB if they were copied
    row, seen = np.zeros(cells[1]), np.broadcast_to(np.ones(1, dtype=bool), cells)
    spec = GridSpec(0.05, -5000, -5000, *cells)
    grid = OccupancyGrid(spec, np.broadcast_to(row, cells), seen)
    tracemalloc.start()
    map_figure(grid).savefig(BytesIO(), format="png")
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 300e6
