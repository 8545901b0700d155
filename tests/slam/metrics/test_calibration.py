import numpy as np
import pytest

from slam.episode import Truth
from slam.grid import GridSpec, OccupancyGrid
from slam.metrics.change import TrueOccupancy

WALL = np.array([[0.0, 0.025, 1.0, 0.025]])
DOOR = np.array([0.0, 0.225, 1.0, 0.225])


def calibration(h_wall: float, h_door: float, h_free: float):
    """A wall, a door that stands there in a quarter of the time, and free cells."""
    away = DOOR + [50.0, 0.0, 50.0, 0.0]
    doors = np.array([[DOOR], [away], [away], [away]])
    occupancy = TrueOccupancy(Truth(np.zeros((4, 3)), WALL, doors))
    h = np.full((64, 64), h_free)
    h[0, :20], h[4, :20] = h_wall, h_door
    observed = np.zeros((64, 64), dtype=bool)
    observed[:8, :20] = True
    return occupancy.calibration(OccupancyGrid(GridSpec(0.05, 0, 0, 64, 64), h, observed))


def test_a_perfect_map_is_on_the_diagonal():
    found = calibration(1.0, 0.25, 0.0)
    assert found.cells == [120, 0, 20, 0, 0, 0, 0, 0, 0, 20]
    for believed, occupied, cells in zip(found.believed, found.occupied, found.cells, strict=True):
        if cells:
            assert occupied == pytest.approx(believed, abs=0.02)


def test_one_that_takes_the_door_for_a_wall_is_not():
    found = calibration(1.0, 1.0, 0.0)
    assert found.cells[9] == 40
    assert found.believed[9] == 1.0
    assert found.occupied[9] == pytest.approx((1.0 + 0.25) / 2, abs=0.02)
