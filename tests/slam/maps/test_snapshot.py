import numpy as np

from slam.grid import GridSpec, OccupancyGrid
from slam.maps.snapshot import MapSnapshot


def test_the_map_comes_back_to_half_a_percent_and_the_scan_is_the_last_pose() -> None:
    rng = np.random.default_rng(3)
    spec = GridSpec(0.05, -64, 128, 128, 64)
    observed = rng.random(spec.shape) < 0.4
    grid = OccupancyGrid(spec, np.where(observed, rng.random(spec.shape), 0.5), observed)
    stage = MapSnapshot.of(np.zeros((7, 3)), grid)
    assert stage.scan == 6
    assert stage.grid.spec == spec
    assert (stage.grid.observed == observed).all()
    assert np.abs(stage.grid.occupied - grid.occupied).max() <= 0.005 + 1e-12


def test_it_is_small() -> None:
    spec = GridSpec(0.05, 0, 0, 1024, 1024)
    grid = OccupancyGrid(spec, np.full(spec.shape, 0.5), np.zeros(spec.shape, np.bool_))
    assert len(MapSnapshot.of(np.zeros((1, 3)), grid).packed) < 1e-2 * grid.observed.nbytes
