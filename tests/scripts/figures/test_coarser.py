# pyright: reportMissingImports=false
import numpy as np
import pytest
from dynslam_cli.figures.coarser import coarser

from slam.grid import GridSpec, OccupancyGrid


@pytest.mark.parametrize(("pixel", "fold"), [(0.01, 1), (0.09, 1), (0.1, 2), (0.5, 8), (1e6, 64)])
def test_thin_walls_and_single_sights_stay(pixel: float, fold: int) -> None:
    rng = np.random.default_rng(1)
    spec = GridSpec(0.05, -64, 192, 128, 64)
    observed = rng.random(spec.shape) < 0.02
    grid = OccupancyGrid(spec, rng.random(spec.shape), observed)
    small = coarser(grid, pixel)
    assert small.spec.extent == pytest.approx(spec.extent)
    assert small.spec.resolution == pytest.approx(0.05 * fold)
    for row in range(small.spec.rows):
        for col in range(small.spec.cols):
            part = slice(row * fold, (row + 1) * fold), slice(col * fold, (col + 1) * fold)
            seen = grid.occupied[part][observed[part]]
            assert small.observed[row, col] == bool(len(seen))
            if len(seen):
                assert small.occupied[row, col] == seen.max()
