import numpy as np
import pytest
from scipy import ndimage

from dynslam_env.navigation.frontiers import GATE_DISTANCE, frontier_cells, frontiers
from dynslam_env.navigation.planner import plan
from dynslam_env.navigation.regions import grouped
from slam import Pose2
from tests.dynslam_env.navigation.drawn import drawn

ROOM = """
##########
#........#
#........
#........
#........
#........#
##########
"""


def seen(text, x=0.25, y=0.25):
    costmap = drawn(text)
    return costmap, plan(costmap, Pose2(x, y, 0.0))


def test_a_gap_in_the_wall_is_the_one_frontier():
    costmap, ways = seen(ROOM)
    (gap,) = frontiers(costmap, ways, (0.25, 0.25), min_cells=3)
    assert gap.size == 3
    assert gap.centroid == pytest.approx([0.85, 0.35])
    assert gap.beyond == pytest.approx([1.85, 0.35])
    assert gap.cell == (2, 8)
    assert gap.length == pytest.approx(0.6)
    assert gap.distance == pytest.approx(0.6)


def test_a_small_one_does_not_count():
    costmap, ways = seen(ROOM)
    assert frontiers(costmap, ways, (0.25, 0.25), min_cells=4) == []


def test_one_behind_a_wall_has_no_cell():
    costmap, ways = seen("....#......    ", x=0.05, y=0.05)
    (far,) = frontiers(costmap, ways, (0.05, 0.05), min_cells=1)
    assert far.cell is None
    assert far.length == np.inf


@pytest.mark.parametrize("seed", range(12))
def test_each_is_explored_from_the_cheapest_of_the_cells_nearest_to_its_own(seed: int) -> None:
    """Those within 0.4 m; of equally near cells scipy's choice, of equally cheap ones the first."""
    rng = np.random.default_rng(seed)
    text = "\n".join("".join(rng.choice(list("###... "), 60)) + "#" for _ in range(50))
    costmap, ways = seen(text, x=1.55, y=1.55)
    assert ways.reached.any()
    away, nearest = ndimage.distance_transform_edt(  # type: ignore[misc]
        ~ways.reached, sampling=costmap.spec.resolution, return_indices=True
    )
    cells, ends = grouped(frontier_cells(costmap))
    expected = []
    for own in np.split(cells, ends, axis=1)[:-1]:
        near = [tuple(nearest[:, r, c].tolist()) for r, c in own.T if away[r, c] <= GATE_DISTANCE]
        expected.append(min(near, key=lambda cell: ways.cost[cell], default=None))
    found = [one.cell for one in frontiers(costmap, ways, (1.55, 1.55), min_cells=1)]
    assert found == expected
    assert None in found


def test_every_frontier_cell_is_free_and_beside_the_unknown():
    rng = np.random.default_rng(0)
    text = "\n".join("".join(rng.choice(list("#.. "), 30)) + "#" for _ in range(20))
    costmap = drawn(text)
    cells, kinds = frontier_cells(costmap), np.pad(costmap.kinds, 1, constant_values=3)
    for row, col in np.ndindex(cells.shape):
        r, c = row + 1, col + 1
        beside = (kinds[r - 1, c], kinds[r + 1, c], kinds[r, c - 1], kinds[r, c + 1])
        assert cells[row, col] == (kinds[r, c] in (1, 2) and 0 in beside)
