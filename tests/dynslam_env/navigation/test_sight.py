import numpy as np

from dynslam_env.navigation.planner import plan
from dynslam_env.navigation.sight import in_sight, viewpoint
from slam import Pose2
from tests.dynslam_env.navigation.drawn import drawn

CORNER = """
....................
....................
###############.....
....................
....................
"""


def test_behind_a_corner_the_first_cell_that_sees_it_is_taken():
    costmap = drawn(CORNER)
    ways, target = plan(costmap, Pose2(0.05, 0.05, 0.0)), np.array([0.15, 0.45])
    cell = viewpoint(costmap, ways, target, hidden_radius=0.1, min_distance=0.3, max_distance=3.0)
    assert cell is not None
    assert in_sight(costmap, cell, target, 0.1)
    others = [
        tuple(other)
        for other in np.argwhere(ways.reached)
        if ways.cost[tuple(other)] < ways.cost[cell] - 1e-9
    ]
    away = costmap.spec.centres(np.array(others)) - target
    far_enough = np.hypot(*away.T) >= 0.3
    assert not any(
        in_sight(costmap, (int(r), int(c)), target, 0.1)
        for (r, c), far in zip(others, far_enough, strict=True)
        if far
    )


def test_what_is_all_around_hidden_is_seen_from_nowhere():
    costmap = drawn("." * 20 + "\n" + "#" * 20 + "\n" + "." * 20 + "\n")
    ways = plan(costmap, Pose2(0.05, 0.05, 0.0))
    assert viewpoint(costmap, ways, np.array([0.55, 0.25]), 0.05, 0.1) is None


def test_its_own_leaf_hides_no_door():
    costmap = drawn("." * 20 + "\n" + "#" * 20 + "\n" + "." * 20 + "\n")
    ways = plan(costmap, Pose2(0.05, 0.05, 0.0))
    assert viewpoint(costmap, ways, np.array([0.55, 0.15]), 0.3, 0.1) is not None


def test_from_outside_the_map_nothing_is_seen():
    costmap = drawn("....")
    ways = plan(costmap, Pose2(0.05, 0.05, 0.0))
    assert viewpoint(costmap, ways, np.array([50.0, 50.0]), 0.3) is None
