from dataclasses import replace

import numpy as np
import pytest

from slam.geometry import Pose2
from slam.grid import GridSpec, OccupancyGrid
from slam.layers import Layers, layers
from slam.layers.classification import FREE, NO_REASON, STATIC, UNKNOWN
from slam.layers.doors import MappedDoor
from slam.layers.masking import map_without_masked, masked_cells, without_masked
from tests.slam.layers.rooms import box, watch

ROOM = np.concatenate([box(-3.02, -1.02, 3.02, 1.02), box(1.0, -0.2, 1.4, 0.2)])
DOOR = MappedDoor(np.array([(2.0, 0.0), (2.8, 0.0)]), 0.5, 3, 9.0, 0.0, 9.0, 5, 5, 0.95)
AREA = (0.8, 1.6, -0.4, 0.4)  # m: left, right, low, high; the box in the room stands in it


@pytest.fixture(scope="module")
def made() -> Layers:
    scans, poses = watch([ROOM] * 30, [Pose2(x, 0.5, 0.0) for x in np.linspace(-1.5, 1.5, 30)])
    return replace(layers(scans, poses), doors=(DOOR,))


def mask_of(resolution: float, extent=(-1.0, 2.0, -1.0, 1.0), area=AREA) -> OccupancyGrid:
    """A mask of its own size and resolution: black in an area."""
    left, right, low, high = (round(value / resolution) for value in extent)
    spec = GridSpec(resolution, low, left, high - low, right - left)
    x, y = spec.centres(np.indices(spec.shape).reshape(2, -1).T).T
    black = (x > area[0]) & (x < area[1]) & (y > area[2]) & (y < area[3])
    return OccupancyGrid(spec, black.reshape(spec.shape) * 1.0, np.ones(spec.shape, bool))


def inside(made: Layers) -> np.ndarray:
    x, y = made.spec.centres(np.indices(made.spec.shape).reshape(2, -1).T).T
    area = (x > AREA[0]) & (x < AREA[1]) & (y > AREA[2]) & (y < AREA[3])
    return area.reshape(made.spec.shape)


@pytest.mark.parametrize("resolution", [0.02, 0.05, 0.1, 0.2])
def test_a_mask_of_any_size_and_resolution_clears_its_area_only(made, resolution: float) -> None:
    cleared, area = without_masked(made, mask_of(resolution)), inside(made)
    assert (made.kind[area] == STATIC).any()
    assert not np.isin(cleared.kind[area], (STATIC,)).any()
    assert (cleared.kind[area & (made.kind != UNKNOWN)] == FREE).all()
    assert (cleared.kind[area & (made.kind == UNKNOWN)] == UNKNOWN).all()
    assert (cleared.reason[area] == NO_REASON).all()
    assert (cleared.kind[~area] == made.kind[~area]).all()
    assert not (cleared.static_map().occupied[area] > 0.5).any()


def test_doors_in_the_mask_go_and_others_stay(made: Layers) -> None:
    assert without_masked(made, mask_of(0.05)).doors == (DOOR,)
    over_door = mask_of(0.1, (1.0, 4.0, -1.0, 1.0), (2.2, 2.6, -0.2, 0.2))
    assert without_masked(made, over_door).doors == ()


def test_a_mask_elsewhere_changes_nothing(made: Layers) -> None:
    far = mask_of(0.1, (50.0, 52.0, 50.0, 52.0), (50.0, 52.0, 50.0, 52.0))
    assert not masked_cells(made.spec, far).any()
    assert (without_masked(made, far).kind == made.kind).all()


def test_a_map_is_cleared_where_it_was_observed(made: Layers) -> None:
    grid, area = made.static_map(), inside(made)
    cleared = map_without_masked(grid, mask_of(0.05))
    assert (cleared.occupied[area & grid.observed] == 0).all()
    assert (cleared.occupied[area & ~grid.observed] == 0.5).all()
    assert (cleared.occupied[~area] == grid.occupied[~area]).all()
