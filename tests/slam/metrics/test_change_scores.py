import numpy as np
import pytest

from slam.episode import Truth
from slam.errors import InputError
from slam.grid import GridSpec, OccupancyGrid
from slam.metrics.change import TrueOccupancy

WALL = (0.2, 0.2, 3.8, 0.2)  # through the cells (0, 0) to (0, 3) of 1 m
CLOSED, OPEN = (1.5, 1.5, 1.6, 1.6), (2.5, 2.5, 2.6, 2.6)  # within the cells (1, 1) and (2, 2)


def world() -> Truth:
    """A wall, and a door that is closed at three of four scans and open at the last."""
    doors = np.array([[CLOSED], [CLOSED], [CLOSED], [OPEN]])
    return Truth(np.zeros((4, 3)), np.array([WALL]), doors)


def grid_with(values: np.ndarray, spec: GridSpec) -> OccupancyGrid:
    return OccupancyGrid(spec, values, np.ones(spec.shape, bool))


def test_shares_of_time_by_hand() -> None:
    truth = TrueOccupancy(world(), 1.0)
    expected = np.zeros((4, 4))
    expected[0, :4], expected[1, 1], expected[2, 2] = 1.0, 0.75, 0.25
    assert truth.share[:4, :4] == pytest.approx(expected)
    assert truth.share.sum() == pytest.approx(expected.sum())
    assert truth.now[2, 2]
    assert not truth.now[1, 1]


def test_brier_scores_by_hand_on_a_grid_of_another_place() -> None:
    spec = GridSpec(1.0, -1, -1, 4, 4)  # one row and column before the truth's first cells
    h = np.zeros(spec.shape)
    h[2, 2], h[3, 3] = 0.75, 0.25  # both cells of the door right
    h[0, 0] = 0.5  # nothing stands there
    scores = TrueOccupancy(world(), 1.0).score(grid_with(h, spec))
    assert scores.brier_share_door == 0
    assert scores.brier_share_static == pytest.approx((0.25 + 3 * 1.0) / 14)
    assert scores.brier_share_all == pytest.approx((0.25 + 3 * 1.0) / 16)
    assert scores.brier_now_door == pytest.approx(0.75**2)
    assert scores.brier_now_static == scores.brier_share_static


def test_the_true_share_is_the_best_map_of_change() -> None:
    truth = TrueOccupancy(world(), 0.1)
    assert truth.score(grid_with(truth.share, truth.spec)).brier_share_all == 0
    now = truth.score(grid_with(truth.now.astype(float), truth.spec))
    assert now.brier_now_all == 0 < now.brier_share_door


def test_only_observed_cells_count_and_none_is_none_in_json() -> None:
    truth = TrueOccupancy(world(), 1.0)
    unseen = OccupancyGrid(truth.spec, truth.share, np.zeros(truth.spec.shape, bool))
    assert set(truth.score(unseen).as_dict().values()) == {None}
    static = TrueOccupancy(Truth(np.zeros((1, 3)), np.array([WALL]), np.empty((1, 0, 4))), 1.0)
    scores = static.score(grid_with(static.share, static.spec)).as_dict()
    assert scores["brier_share_door"] is None
    assert scores["brier_share_all"] == 0


def test_moments_added_one_by_one_give_what_all_at_once_give() -> None:
    rng = np.random.default_rng(0)
    doors = np.cumsum(rng.uniform(-0.5, 0.6, (40, 3, 4)), axis=0)  # that leave the first tiles
    poses, walls = np.zeros((40, 3)), np.array([WALL])
    whole = TrueOccupancy(Truth(poses, walls, doors), 0.05)
    grown = TrueOccupancy(Truth(poses[:1], walls, doors[:1]), 0.05)
    first = grown.spec
    for begin, end in ((1, 2), (2, 17), (17, 40)):
        grown.add(doors[begin:end])
        so_far = TrueOccupancy(Truth(poses[:end], walls, doors[:end]), 0.05)
        assert grown.spec == so_far.spec
        assert (grown.share == so_far.share).all()
        assert (grown.now == so_far.now).all()
    assert first.shape < grown.spec.shape
    grid = grid_with(rng.random(whole.spec.shape), whole.spec)
    assert grown.score(grid) == whole.score(grid)


def test_another_resolution_is_refused() -> None:
    spec = GridSpec(0.05, 0, 0, 4, 4)
    with pytest.raises(InputError, match=r"0\.05 m"):
        TrueOccupancy(world(), 1.0).score(grid_with(np.zeros((4, 4)), spec))


def test_a_grid_within_the_truth_is_compared_cell_by_cell() -> None:
    truth = TrueOccupancy(world(), 1.0)
    spec = GridSpec(1.0, 1, 1, 2, 2)
    assert truth.score(grid_with(truth.share[1:3, 1:3], spec)).brier_share_all == 0
