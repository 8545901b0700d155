import math

import numpy as np
import pytest

from slam.geometry import Pose2, compose
from slam.search.correlative import Correlative
from slam.search.gauss_newton import GaussNewton
from slam.search.hill_climb import HillClimb
from slam.search.random_restart import RandomRestart
from tests.slam.search.maps import in_room, room
from tests.slam.search.objectives import WIDTH, Peaks, Plain, posterior

SEARCHES = [HillClimb(), RandomRestart(), Correlative(), GaussNewton()]
SEEING = [RandomRestart(restarts=30), Correlative(step=0.03, reach=1.5)]  # more than one peak
DEVIATIONS = np.array([0.06, 0.06, 0.1])
START = Pose2(1.0, -2.0, 3.1)  # a heading that wraps nearby


def error(found: Pose2, peak) -> tuple[float, float]:
    """m and rad."""
    away = Pose2.of(peak).between(found)
    return math.hypot(away.x, away.y), abs(away.theta)


def value(asked, pose) -> float:
    return float(asked(np.array([pose]))[0])


@pytest.mark.parametrize("search", SEARCHES)
@pytest.mark.parametrize("seed", range(4))
def test_the_peak_is_found_to_precision(search, seed: int) -> None:
    rng = np.random.default_rng(seed)
    peak = compose(START, rng.uniform(-0.7, 0.7, 3) * DEVIATIONS)
    asked = posterior(Peaks(peak, width=0.02 * WIDTH), START, DEVIATIONS)
    metres, radians = error(search(asked, rng), peak)
    assert metres < 0.0015
    assert radians < math.radians(0.1)


@pytest.mark.parametrize("search", SEARCHES)
def test_a_start_at_the_peak_is_kept(search) -> None:
    asked = posterior(Peaks(START), START, DEVIATIONS)
    found = search(asked, np.random.default_rng(0))
    assert error(found, START) == pytest.approx((0, 0), abs=1e-12)


@pytest.mark.parametrize("search", SEARCHES)
def test_where_nothing_is_seen_it_ends_where_the_odometry_leads(search) -> None:
    displacement = Pose2(0.2, -0.05, 0.3)
    asked = posterior(Plain(), START, DEVIATIONS, displacement)
    assert search(asked, np.random.default_rng(0)) == pytest.approx(START @ displacement, abs=1e-9)


@pytest.mark.parametrize("search", SEARCHES)
@pytest.mark.parametrize("seed", range(3))
def test_the_prior_and_the_scan_are_weighed(search, seed: int) -> None:
    """Of two Gaussians of equal width the product peaks half way."""
    off = np.random.default_rng(seed).uniform(-0.04, 0.04, 3)
    asked = posterior(Peaks(np.array(START) + off), START, WIDTH)
    found = search(asked, np.random.default_rng(0))
    assert error(found, np.array(START) + off / 2) == pytest.approx((0, 0), abs=1.5e-3)


@pytest.mark.parametrize("seed", range(4))
def test_only_climbing_stays_at_the_lower_of_two_peaks(seed: int) -> None:
    low, high = compose(START, (0.02, 0.0, 0.0)), compose(START, (-0.06, 0.05, -0.12))
    reading = Peaks([low, high], [0.0, 3.0], 0.4 * WIDTH)
    asked = posterior(reading, START, DEVIATIONS)

    def end(search) -> Pose2:
        return search(asked, np.random.default_rng(seed))

    for search in (HillClimb(), GaussNewton()):
        assert error(end(search), low)[0] < 0.005
    for search in SEEING:
        assert error(end(search), high)[0] < 0.025  # the prior draws


@pytest.mark.parametrize("search", SEARCHES)
def test_the_place_is_found_in_a_room(search) -> None:
    truth = Pose2(0.717, -0.344, 2.2)
    asked = in_room(room(), truth, truth @ Pose2(0.03, -0.02, 0.05), Pose2(), DEVIATIONS)
    metres, radians = error(search(asked, np.random.default_rng(0)), truth)
    assert metres < 0.012
    assert radians < math.radians(0.5)


@pytest.mark.parametrize("search", SEARCHES)
def test_the_same_seed_gives_the_same_pose(search) -> None:
    truth = Pose2(0.717, -0.344, 2.2)
    asked = in_room(room(), truth, truth @ Pose2(0.1, -0.1, 0.1), Pose2(), DEVIATIONS)
    first, again = (search(asked, np.random.default_rng(5)) for _ in range(2))
    assert first == again


# -- hill climbing -----------------------------------------------------------------------------


def test_climbing_never_ends_lower_than_it_began() -> None:
    starts = np.random.default_rng(3).normal(size=(20, 3)) * 0.2
    asked = posterior(Peaks([(0.1, 0.0, 0.0), (-0.2, 0.1, 0.1)], [0.0, 2.0]))
    ends = HillClimb().climb(asked, starts)
    assert (asked(ends) >= asked(starts)).all()
    alone = [HillClimb().climb(asked, start[None])[0] for start in starts]
    np.testing.assert_array_equal(ends, alone)


def test_climbing_a_plain_ends_and_stays() -> None:
    starts = np.ones((3, 3))
    ends = HillClimb().climb(lambda poses: np.zeros(len(poses)), starts)
    np.testing.assert_array_equal(ends, starts)


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


def test_a_climber_takes_the_best_of_its_neighbours() -> None:
    reading = Peaks((0.0, -1.0, 0.0), width=(1.0, 1.0, 1.0))
    HillClimb(step=0.1, turn=0.1, precision=0.1).climb(
        posterior(reading), np.array([[0.05, 0.0, 0.0]])
    )
    assert reading.asked[2][:, 1].mean() == pytest.approx(-0.1)


# -- random restarts ---------------------------------------------------------------------------


def starts_of(restarts: int, seed: int, displacement=Pose2(), deviations=DEVIATIONS) -> np.ndarray:
    """The poses at which the climbs start."""
    reading = Plain()
    asked = posterior(reading, START, deviations, displacement)
    RandomRestart(restarts=restarts)(asked, np.random.default_rng(seed))
    return reading.asked[0]


def test_the_same_seed_restarts_at_the_same_places() -> None:
    first, again, other = (starts_of(3, seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert not np.array_equal(first, other)
    assert first[0] == pytest.approx(START)
    assert len(first) == 4


def test_restarts_are_drawn_from_the_motion_model() -> None:
    displacement = Pose2(0.5, 0.1, 0.4)
    starts = starts_of(4000, 0, displacement)
    asked = posterior(Plain(), START, DEVIATIONS, displacement)
    chi2 = -2 * asked.prediction.log_density(starts[1:])
    assert chi2.mean() == pytest.approx(3.0, abs=0.2)  # three independent errors
    assert chi2.var() == pytest.approx(6.0, rel=0.2)


def test_no_restart_is_hill_climbing() -> None:
    truth = Pose2(0.717, -0.344, 2.2)
    asked = in_room(room(), truth, truth @ Pose2(0.1, -0.1, 0.1), Pose2(), DEVIATIONS)
    rng = np.random.default_rng(0)
    assert RandomRestart(restarts=0)(asked, rng) == pytest.approx(HillClimb()(asked, rng))


def test_more_restarts_find_no_less() -> None:
    truth = Pose2(0.717, -0.344, 2.2)
    asked = in_room(
        room(), truth, truth @ Pose2(0.7, -0.5, 0.9), Pose2(), np.array([0.8, 0.6, 1.0])
    )
    ends = [RandomRestart(n)(asked, np.random.default_rng(0)) for n in (0, 10, 40)]
    values = [value(asked, end) for end in ends]
    assert values == sorted(values)
    assert values[2] > values[0] + 20
