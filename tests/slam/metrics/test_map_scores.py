import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slam.episode import Truth
from slam.geometry import Pose2, transform_points
from slam.grid import GridSpec, OccupancyGrid
from slam.metrics.mapping import distances, score_map
from slam.metrics.raster import rasterise
from slam.metrics.surface import TrueSurface, sampled, visible_truth
from slam.scan import Scan

ROOM = np.array([[0.0, 0, 4, 0], [4, 0, 4, 2], [4, 2, 0, 2], [0, 2, 0, 0]]) + 0.012
SPEC = GridSpec.around((-1, -1), (5, 3), 0.05)


def whole(segments: np.ndarray) -> TrueSurface:
    return TrueSurface(segments, sampled(segments, 0.025))


def map_of(segments: np.ndarray) -> OccupancyGrid:
    occupied = np.where(rasterise(segments, SPEC), 0.9, 0.1)
    return OccupancyGrid(SPEC, occupied, np.ones(SPEC.shape, bool))


def test_the_true_map_is_perfect() -> None:
    scores = score_map(map_of(ROOM), whole(ROOM))
    assert (scores.precision_5cm, scores.recall_5cm, scores.f1_5cm) == (1, 1, 1)
    assert scores.adnn_map_to_truth < 0.025
    assert scores.adnn_truth_to_map < 0.036


def test_a_wall_too_many_costs_precision_and_one_too_few_recall() -> None:
    more = score_map(map_of(np.vstack([ROOM, [[1, 1, 3, 1]]])), whole(ROOM))
    fewer = score_map(map_of(ROOM[:3]), whole(ROOM))
    assert more.recall_5cm == 1 > more.precision_5cm
    assert fewer.precision_5cm == 1 > fewer.recall_5cm
    assert fewer.recall_5cm == pytest.approx(10 / 12, abs=0.02)
    assert more.adnn_map_to_truth > 0.1 > more.adnn_truth_to_map
    assert fewer.adnn_truth_to_map > 0.1 > fewer.adnn_map_to_truth


def test_tolerances_are_inclusive_and_differ() -> None:
    line = np.array([[0.01, 1.025, 3.99, 1.025]])  # the middle of a row of cells
    at_5, at_10, at_15 = (
        score_map(map_of(line + (0, shift, 0, shift)), whole(line)) for shift in (0.05, 0.1, 0.15)
    )
    assert (at_5.precision_5cm, at_5.f1_10cm) == (1, 1)
    assert (at_10.precision_5cm, at_10.recall_5cm, at_10.precision_10cm) == (0, 0, 1)
    assert (at_15.precision_10cm, at_15.recall_10cm) == (0, 0)


def test_the_scores_of_a_moved_map_are_those_of_the_aligned_one() -> None:
    shift = Pose2(0.5, -0.25, math.pi / 2)
    walls = np.array([[1.0, 0, 1, 2], [1, 2, 3, 2]]) + 0.012
    ends = transform_points(shift.inverse(), walls.reshape(-1, 2)).reshape(-1, 4)
    grid = map_of(ends)
    assert score_map(grid, whole(walls)).f1_10cm < 0.5
    aligned = score_map(grid, whole(walls), shift)
    assert aligned.f1_5cm > 0.99
    assert aligned.as_dict("_aligned")["f1_5cm_aligned"] == aligned.f1_5cm


def test_an_empty_map_scores_zero_and_is_none_in_json() -> None:
    empty = OccupancyGrid(SPEC, np.full(SPEC.shape, 0.5), np.ones(SPEC.shape, bool))
    scores = score_map(empty, whole(ROOM)).as_dict()
    assert scores["f1_5cm"] == 0
    assert scores["adnn_map_to_truth"] is None
    assert scores["adnn_truth_to_map"] is None


def test_an_unobserved_cell_is_not_occupied_and_an_empty_world_scores_zero() -> None:
    grid = map_of(ROOM)
    unseen = OccupancyGrid(SPEC, grid.occupied, np.zeros(SPEC.shape, bool))
    assert score_map(unseen, whole(ROOM)).occupied_cells == 0
    nothing = score_map(grid, whole(np.empty((0, 4))))
    assert (nothing.f1_10cm, nothing.adnn_map_to_truth) == (0, math.inf)


coordinate = st.floats(-5, 5)


@given(
    st.lists(st.tuples(coordinate, coordinate), min_size=1, max_size=4),
    st.lists(st.tuples(*[coordinate] * 4), min_size=1, max_size=4),
)
def test_distances_agree_with_dense_sampling(points: list, segments: list) -> None:
    found = distances(np.array(points), np.array(segments))
    along = np.linspace(0, 1, 2001)[:, None]
    for point, distance in zip(points, found, strict=True):
        naive = min(
            np.hypot(*(s[:2] + along * (s[2:] - s[:2]) - point).T).min() for s in np.array(segments)
        )
        assert distance <= naive + 1e-9
        assert distance == pytest.approx(naive, abs=0.01)


def test_samples_are_even_and_on_the_segments() -> None:
    points = sampled(np.array([[0.0, 0, 1, 0], [2, 0, 2, 0], [0, 1, 0, 1.5]]), 0.25)
    assert points == pytest.approx(
        np.array([[0.125, 0], [0.375, 0], [0.625, 0], [0.875, 0], [0, 1.125], [0, 1.375]])
    )


def test_only_what_was_seen_counts() -> None:
    """One beam straight ahead from each of two poses: two patches of the far wall are visible."""
    walls = np.array([[2.0, -5, 2, 5]])
    doors = np.array([[[1.0, 3, 1.5, 3]]] * 2)
    scans = [Scan(np.array([2.0]), np.zeros(1), 8.0), Scan(np.array([np.inf]), np.zeros(1), 8.0)]
    truth = Truth(np.zeros((2, 3)), walls, doors)
    surface = visible_truth(truth, scans, 0.05)
    assert len(surface.segments) == 2
    assert len(surface.points) > 0
    assert np.abs(surface.points - (2, 0)).max() <= 0.1
