import numpy as np
import pytest

from dynslam_env.navigation.costmap import (
    OCCUPIED,
    OPEN,
    TIGHT,
    UNKNOWN,
    Inflation,
    coarse,
    costmap,
    inflated,
    nearer_than,
)
from slam import InputError, Pose2, Scan
from slam.grid import GridSpec, OccupancyGrid
from tests.dynslam_env.navigation.drawn import believed, drawn

SILENT = Scan(np.full(3, np.inf), np.array([-1.0, 0.0, 1.0]), 8.0)


def grid(rows=64, cols=64):
    spec = GridSpec(0.05, -64, 0, rows, cols)
    return OccupancyGrid(spec, np.zeros(spec.shape), np.ones(spec.shape, dtype=np.bool_))


def test_four_cells_become_one_at_the_same_place():
    fine = grid()
    fine.occupied[11, 21] = 0.9
    fine.observed[40:42, 40:42] = False
    fine.observed[50, 50] = False
    spec, occupied, observed = coarse(fine, 0.5)
    assert spec.extent == pytest.approx(fine.spec.extent)
    assert np.argwhere(occupied).tolist() == [[5, 10]]
    assert np.argwhere(~observed).tolist() == [[20, 20]]


def test_the_cost_falls_with_the_clearance():
    spread = drawn("#" + "." * 20, radius=0.2, inflation=Inflation(margin=0.05))
    kinds = spread.kinds[0]
    assert kinds[0] == OCCUPIED
    assert (kinds[1:3] == TIGHT).all()
    assert (kinds[4:] == OPEN).all()
    assert (np.diff(spread.cost[0, 3:]) < 0).all()
    assert spread.cost[0, -1] == pytest.approx(1.0, abs=0.01)


def test_what_the_scan_hits_is_occupied_and_what_the_body_covers_is_not():
    known = grid()
    known.occupied[:] = 1.0
    known.observed[:] = False
    known.observed[26:38, 16:28] = True
    pose = Pose2(1.1, -1.6, 0.0)
    scan = Scan(np.array([1.0]), np.array([0.0]), 8.0)
    made = costmap(known, believed("."), scan, pose, 0.2)
    (row, col), (hit_row, hit_col) = made.spec.cells(np.array([(1.1, -1.6), (2.1, -1.6)]))
    assert made.kinds[row, col] == TIGHT
    assert made.kinds[hit_row, hit_col] == OCCUPIED
    assert made.kinds[0, 0] == UNKNOWN


@pytest.mark.parametrize("x", [1.13, 0.04, 3.19, -5.0])
@pytest.mark.parametrize("radius", [0.01, 0.25, 0.6])
def test_the_body_covers_the_cells_whose_centres_are_half_a_cell_within_it(x, radius):
    solid, pose = grid(), Pose2(x, -1.58, 0.7)
    solid.occupied[:] = 1.0
    made = costmap(solid, believed("."), SILENT, pose, radius)
    cells = np.indices(made.spec.shape).reshape(2, -1).T
    away = np.hypot(*(made.spec.centres(cells) - (x, -1.58)).T)
    own = (cells == made.spec.cells(np.array([(x, -1.58)]))).all(axis=1)
    covered = own | (away < radius - 0.05)
    assert (made.kinds.ravel() != OCCUPIED).tolist() == covered.tolist()


def test_where_the_task_saw_changes_its_prediction_holds():
    shut = grid(128, 128)
    fine = shut.spec.cells(np.array([(1.0, 0.5)]))[0, 0]
    shut.occupied[fine : fine + 3] = 1.0
    text = "............\n" * 3 + "~~~~~~~~~~~~\n" + "............\n" * 3
    beliefs = believed(text)
    pose = Pose2(0.2, 0.2, 0.0)
    made = costmap(shut, beliefs, SILENT, pose, 0.05)
    there = tuple(made.spec.cells(np.array([(1.0, 0.52)]))[0])
    assert made.kinds[there] != OCCUPIED
    assert made.swept[there]
    closed = costmap(shut, beliefs._replace(occupied=beliefs.occupied * 1.8), SILENT, pose, 0.05)
    assert closed.kinds[there] == OCCUPIED


@pytest.mark.parametrize("wrong", [{"margin": -1.0}, {"falloff": 0.0}, {"occupied_threshold": 1.5}])
def test_wrong_inflations_are_refused(wrong):
    with pytest.raises(InputError, match=f"Inflation.{next(iter(wrong))}"):
        Inflation(**wrong)


@pytest.mark.parametrize("share", [0.0, 0.01, 0.1])
@pytest.mark.parametrize("distance", [0.04, 0.24, 0.25, 0.52, 0.55, 5.0])
def test_nearer_than_is_a_threshold_of_the_clearance(share, distance):
    spec = GridSpec(0.1, -3, 5, 37, 23)
    occupied = np.random.default_rng(7).random(spec.shape) < share
    whole = inflated(spec, occupied, ~occupied, np.zeros_like(occupied), 0.2)
    near = nearer_than(occupied, spec.resolution, distance)
    np.testing.assert_array_equal(near, whole.clearance < distance)


def test_beyond_what_was_observed_it_is_unknown_and_far_from_everything():
    spec = GridSpec(0.1, 0, 0, 40, 40)
    occupied, observed = (np.zeros(spec.shape, np.bool_) for _ in range(2))
    observed[10:20, 5:25], occupied[10, 5:25] = True, True
    made = inflated(spec, occupied, observed, np.zeros_like(occupied), 0.2)
    inside = (slice(10, 20), slice(5, 25))
    np.testing.assert_allclose(made.clearance[inside][:, 0], 0.1 * np.arange(10) - 0.05)
    outside = np.ones(spec.shape, np.bool_)
    outside[inside] = False
    assert np.isinf(made.clearance[outside]).all()
    assert (made.kinds[outside] == UNKNOWN).all()
