import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.sparse import lil_matrix
from scipy.sparse.csgraph import dijkstra

from dynslam_env.navigation.costmap import OCCUPIED, OPEN, TIGHT, UNKNOWN, Inflation, inflated
from dynslam_env.navigation.planner import TIGHT_COST_FACTOR, plan, reached
from slam import Pose2
from slam.grid import GridSpec
from tests.dynslam_env.navigation.drawn import drawn


def pose_at(spec, row, col):
    x, y = spec.centres(np.array([(row, col)]))[0]
    return Pose2(x, y, 0.0)


def naive(costmap, row, col):
    """Costs by scipy's Dijkstra over the graph of all moves."""
    rows, cols = costmap.kinds.shape
    graph = lil_matrix((rows * cols, rows * cols))
    kinds = costmap.kinds.copy()
    kinds[row, col] = kinds[row, col] if kinds[row, col] == OPEN else TIGHT
    for r, c in np.ndindex(rows, cols):
        for i, j in np.ndindex(rows, cols):
            if max(abs(r - i), abs(c - j)) != 1 or kinds[r, c] not in (OPEN, TIGHT):
                continue
            if kinds[i, j] == OPEN or (kinds[i, j] == TIGHT and kinds[r, c] == TIGHT):
                prices = [
                    costmap.cost[k] * (TIGHT_COST_FACTOR if kinds[k] == TIGHT else 1.0)
                    for k in ((r, c), (i, j))
                ]
                step = costmap.spec.resolution * np.hypot(r - i, c - j)
                graph[r * cols + c, i * cols + j] = step * sum(prices) / 2
    return dijkstra(graph.tocsr(), indices=row * cols + col).reshape(rows, cols)


@given(st.integers(0, 2**32 - 1))
def test_costs_are_those_of_scipys_dijkstra(seed):
    rng = np.random.default_rng(seed)
    spec = GridSpec(0.1, -3, 5, 9, 11)
    occupied, observed = rng.random(spec.shape) < 0.15, rng.random(spec.shape) < 0.9
    none = np.zeros(spec.shape, dtype=np.bool_)
    costmap = inflated(spec, occupied, observed, none, 0.06, Inflation(margin=0.02))
    row, col = int(rng.integers(9)), int(rng.integers(11))
    found = plan(costmap, pose_at(spec, row, col))
    np.testing.assert_allclose(found.cost, naive(costmap, row, col), rtol=1e-12)


@given(st.integers(0, 2**32 - 1))
def test_no_way_leads_through_what_is_occupied_or_unknown(seed):
    rng = np.random.default_rng(seed)
    spec = GridSpec(0.1, 0, 0, 20, 20)
    occupied, observed = rng.random(spec.shape) < 0.2, rng.random(spec.shape) < 0.9
    none = np.zeros(spec.shape, dtype=np.bool_)
    costmap = inflated(spec, occupied, observed, none, 0.03, Inflation(margin=0.0))
    found = plan(costmap, pose_at(spec, 10, 10))
    for cell in np.argwhere(found.reached):
        path = found.path((int(cell[0]), int(cell[1])))
        kinds = costmap.kinds[tuple(spec.cells(path).T)]
        assert not np.isin(kinds[1:], (OCCUPIED, UNKNOWN)).any()
        free = np.flatnonzero(kinds == OPEN)
        assert len(free) == 0 or (kinds[free[0] :] == OPEN).all()  # once out, never back in
        lengths = np.hypot(*np.diff(path, axis=0).T)
        assert lengths.sum() == pytest.approx(found.length[tuple(cell)])


def test_a_robot_inside_the_inflation_plans_out_of_it():
    costmap = drawn("##########\n" + "..........\n" * 8, radius=0.25)
    found = plan(costmap, pose_at(costmap.spec, 7, 5))
    assert costmap.kinds[7, 5] == TIGHT
    assert found.reached[0].all()


def test_of_two_gaps_the_wide_one_is_taken_by_a_wide_robot():
    costmap = drawn(
        """
...........
...........
###.###...#
...........
...........
""",
        radius=0.14,
    )
    found = plan(costmap, pose_at(costmap.spec, 0, 3))
    assert found.reached[4, 3]
    crossed = costmap.spec.cells(found.path((4, 3)))
    assert (crossed[crossed[:, 0] == 2, 1] == 8).all()


def test_where_no_way_leads_there_is_no_path():
    costmap = drawn("...#...")
    found = plan(costmap, pose_at(costmap.spec, 0, 0))
    assert found.path((0, 6)).shape == (0, 2)
    assert len(found.path((0, 0))) == 1


def test_outside_the_map_nothing_is_reached():
    assert not plan(drawn("..."), Pose2(5.0, 5.0, 0.0)).reached.any()


@given(st.integers(0, 2**32 - 1), st.floats(0.03, 0.3))
def test_a_flood_reaches_what_the_plan_reaches(seed, radius):
    rng = np.random.default_rng(seed)
    spec = GridSpec(0.1, -3, 5, 19, 23)
    occupied, observed = rng.random(spec.shape) < 0.1, rng.random(spec.shape) < 0.95
    none = np.zeros(spec.shape, dtype=np.bool_)
    costmap = inflated(spec, occupied, observed, none, radius, Inflation(margin=0.0))
    start = pose_at(spec, int(rng.integers(19)), int(rng.integers(23)))
    np.testing.assert_array_equal(
        reached(costmap.spec, costmap.kinds, start), plan(costmap, start).reached
    )


def test_nothing_is_reached_from_outside():
    costmap = drawn("...\n...")
    assert not reached(costmap.spec, costmap.kinds, Pose2(-5.0, 0.0, 0.0)).any()
    assert reached(costmap.spec, costmap.kinds, Pose2(0.05, 0.05, 0.0)).all()
