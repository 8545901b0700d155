import math

import numpy as np
import pytest

from slam.geometry import Pose2, compose
from slam.motion import OdometryMotion
from slam.search.correlative import Correlative
from slam.search.hill_climb import HillClimb
from slam.search.random_restart import RandomRestart
from tests.slam.search.objectives import one_peak, two_peaks

SEARCHES = [HillClimb(), RandomRestart(), Correlative()]
DEVIATIONS = np.array([0.06, 0.06, 0.1])
START = Pose2(1.0, -2.0, 3.1)  # a heading that wraps nearby


def error(found: Pose2, peak) -> tuple[float, float]:
    """m and rad."""
    away = Pose2.of(peak).between(found)
    return math.hypot(away.x, away.y), abs(away.theta)


@pytest.mark.parametrize("search", SEARCHES)
@pytest.mark.parametrize("seed", range(4))
def test_the_peak_is_found_to_precision(search, seed: int) -> None:
    rng = np.random.default_rng(seed)
    peak = compose(START, rng.uniform(-1, 1, 3) * DEVIATIONS)
    found = search(one_peak(peak), START, DEVIATIONS, rng)
    metres, radians = error(found, peak)
    assert metres < 0.0015
    assert radians < math.radians(0.1)


@pytest.mark.parametrize("search", SEARCHES)
def test_a_start_at_the_peak_is_kept(search) -> None:
    found = search(one_peak(START), START, DEVIATIONS, np.random.default_rng(0))
    assert error(found, START) == pytest.approx((0, 0), abs=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_only_hill_climbing_stays_at_the_lower_of_two_peaks(seed: int) -> None:
    low, high = compose(START, (0.02, 0.0, 0.0)), compose(START, (-0.06, 0.05, -0.12))
    objective = two_peaks(low, high)

    def end(search) -> Pose2:
        return search(objective, START, DEVIATIONS, np.random.default_rng(seed))

    assert error(end(HillClimb()), low)[0] < 0.002
    assert error(end(RandomRestart(restarts=30)), high)[0] < 0.002
    assert error(end(Correlative()), high)[0] < 0.002


def test_climbing_never_ends_lower_than_it_began() -> None:
    rng = np.random.default_rng(3)
    starts = rng.normal(size=(20, 3)) * 0.2
    objective = two_peaks((0.1, 0.0, 0.0), (-0.2, 0.1, 0.1))
    ends = HillClimb().climb(objective, starts)
    assert (objective(ends) >= objective(starts)).all()
    alone = [HillClimb().climb(objective, start[None])[0] for start in starts]
    np.testing.assert_array_equal(ends, alone)


def test_climbing_a_plain_ends_and_stays() -> None:
    starts = np.ones((3, 3))
    ends = HillClimb().climb(lambda poses: np.zeros(len(poses)), starts)
    np.testing.assert_array_equal(ends, starts)


def test_the_same_seed_restarts_at_the_same_places() -> None:
    asked: list[np.ndarray] = []

    def objective(poses):
        asked.append(poses)
        return one_peak(START)(poses)

    for seed in (1, 1, 2):
        RandomRestart(restarts=3)(objective, START, DEVIATIONS, np.random.default_rng(seed))
    starts = [poses for poses in asked if len(poses) == 4][::2]
    first, again, other = starts[0], starts[1], starts[2]
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, other)
    np.testing.assert_array_equal(first[0], START)


def test_the_coarse_stage_visits_zero_and_covers_its_reach_evenly() -> None:
    search = Correlative(step=0.03, turn=math.radians(1.0), reach=2.0)
    found = search.candidates(DEVIATIONS)
    assert [0.0, 0.0, 0.0] in found.tolist()
    for axis, step in enumerate((0.03, 0.03, math.radians(1.0))):
        ticks = np.unique(found[:, axis])
        np.testing.assert_allclose(np.diff(ticks), step)
        np.testing.assert_allclose(ticks, -ticks[::-1], atol=1e-12)
        assert 2.0 * DEVIATIONS[axis] <= ticks[-1] < 2.0 * DEVIATIONS[axis] + step
    assert len(found) == len(np.unique(found, axis=0)) == 9 * 9 * 25


def test_a_robot_that_cannot_have_moved_is_looked_for_where_it_was() -> None:
    assert Correlative().candidates(np.zeros(3)).tolist() == [[0.0, 0.0, 0.0]]


def test_a_leap_of_the_odometry_does_not_drown_the_search() -> None:
    deviations = OdometryMotion().deviations(Pose2(5.0))
    assert len(Correlative().candidates(deviations)) < 1_000_000


def test_a_climber_looks_to_and_fro_along_its_own_axes() -> None:
    asked: list[np.ndarray] = []

    def objective(poses):
        asked.append(poses)
        return np.zeros(len(poses))

    start, steps = np.array([[1.0, -2.0, 0.8]]), np.array([0.04, 0.04, 0.1])
    HillClimb(step=0.04, turn=0.1).climb(objective, start)
    for around, scale in zip(asked[1:3], (1.0, 0.5), strict=True):
        expected = compose(start, np.vstack([np.diag(steps), -np.diag(steps)]) * scale)
        np.testing.assert_allclose(
            around[np.lexsort(around.T)], expected[np.lexsort(expected.T)], atol=1e-12
        )
