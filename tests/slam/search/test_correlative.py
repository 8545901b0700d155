"""The correlative search finds the best candidate, or one about as good."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slam.errors import InputError
from slam.geometry import Pose2
from slam.interface import Posterior
from slam.maps.static import Static
from slam.motion.gaussian import GaussianMotion, Prediction
from slam.scan import Scan
from slam.search.correlative import Correlative
from slam.search.gauss_newton import GaussNewton
from slam.sensor_models.endpoint import Endpoint
from tests.slam.search.maps import in_room, room, view
from tests.slam.search.objectives import Level, Peaks, Plain, Stepped, posterior

TRUTH = Pose2(0.717, -0.344, 2.2)
START = Pose2(1.0, -2.0, 3.1)  # a heading that wraps nearby


def candidates(search: Correlative, deviations) -> np.ndarray:
    """(n, 3) the grid by hand: errors from -reach to reach, heading outermost, then x, then y."""
    limits = np.minimum(search.reach * np.asarray(deviations), (0.5, 0.5, math.pi))
    axes = []
    for limit, step in zip(limits, (search.step, search.step, search.turn), strict=True):
        n = max(math.ceil(limit / step - 0.5), 0)
        axes.append(np.arange(-n, n + 1) * step)
    xs, ys, turns = axes
    return np.array([(x, y, turn) for turn in turns for x in xs for y in ys])


def first_of_the_best(search: Correlative, asked: Posterior) -> Pose2:
    """Evaluate every candidate, in order."""
    errors = candidates(search, asked.prediction.deviations)
    poses = asked.prediction.poses(errors)
    return Pose2.of(poses[asked(poses).argmax()])


# -- the best candidate ------------------------------------------------------------------------

near = st.floats(-0.25, 0.25)
deviations = st.tuples(
    st.floats(1e-4, 0.6), st.floats(1e-4, 0.6), st.floats(1e-4, 0.3)
)  # sometimes one candidate, sometimes thousands
steps = st.sampled_from([0.02, 0.03, 0.05, 0.07])
turns = st.sampled_from([math.radians(a) for a in (0.5, 1.0, 2.3)])
peaks = st.lists(st.tuples(near, near, near), min_size=1, max_size=4)


@pytest.mark.parametrize("kind", [Posterior, Stepped])
@settings(max_examples=40)
@given(peaks=peaks, deviations=deviations, step=steps, turn=turns, reach=st.floats(0.4, 2.0))
def test_best_is_the_first_of_the_best_of_all(kind, peaks, deviations, step, turn, reach) -> None:
    tops = np.array(peaks) + np.array(START)
    heights = -0.5 * np.arange(len(tops))
    search = Correlative(step=step, turn=turn, reach=reach)
    asked = posterior(Peaks(tops, heights), START, deviations, kind=kind)
    assert search.best(asked) == first_of_the_best(search, asked)


@settings(max_examples=25)
@given(deviations=deviations, step=steps, turn=turns)
def test_of_equals_the_first_is_taken(deviations, step, turn) -> None:
    search = Correlative(step=step, turn=turn)
    asked = posterior(Plain(), START, deviations, kind=Level)
    first = candidates(search, deviations)[:1]
    assert search.best(asked) == Pose2.of(asked.prediction.poses(first)[0])


def test_where_nothing_is_seen_the_odometry_is_best() -> None:
    displacement = Pose2(0.1, 0.02, 0.3)
    asked = posterior(Plain(), START, (0.1, 0.1, 0.2), displacement)
    assert Correlative().best(asked) == pytest.approx(START @ displacement)


@pytest.mark.parametrize("model", ["static", "histogram"])
@pytest.mark.parametrize("resolution", [0.025, 0.05, 0.1])
@pytest.mark.parametrize("beta", [0.2, 1.0])
@settings(max_examples=12)
@given(
    off=st.tuples(near, near, near),
    deviations=deviations,
    step=steps,
    turn=turns,
    displacement=st.tuples(near, near, near),
)
def test_no_candidate_in_a_real_map_is_much_better_than_the_best(
    model, resolution, beta, off, deviations, step, turn, displacement
) -> None:
    displacement = Pose2(*displacement)
    start = TRUTH @ Pose2(*off) @ displacement.inverse()
    asked = in_room(room(resolution, model, beta), TRUTH, start, displacement, np.array(deviations))
    search = Correlative(step=step, turn=turn, reach=1.0)
    found, best = search.best(asked), first_of_the_best(search, asked)
    if found != best:  # by cells, the best one is not among those that are compared in full
        lost = np.diff(asked(np.array([found, best])))
        assert 0.0 < lost < 1.0  # nats


def test_without_echoes_the_odometry_is_best() -> None:
    prediction = Prediction(TRUTH, Pose2(0.1, 0.02, 0.3), np.array([0.1, 0.1, 0.2]))
    empty = Scan(np.zeros(0), np.zeros(0), 6.0)
    assert Correlative().best(Posterior(room(), empty, prediction)) == pytest.approx(
        prediction.pose
    )


@settings(max_examples=20)
@given(x=st.floats(-6, 6), y=st.floats(-6, 6), heading=st.floats(-3.2, 3.2))
def test_best_is_the_first_of_the_best_at_the_maps_border_and_outside(x, y, heading) -> None:
    asked = in_room(room(), TRUTH, Pose2(x, y, heading), Pose2(), np.array([0.2, 0.2, 0.05]))
    search = Correlative(step=0.07, reach=1.5)
    assert search.best(asked) == first_of_the_best(search, asked)


def test_best_is_the_first_of_the_best_where_a_hit_is_likelier_than_certain() -> None:
    try:
        reading = Endpoint(z_hit=1.0, z_rand=0.5)
    except InputError:
        return  # shares of more than the whole may well be refused
    grid = Static()
    for _ in range(5):
        reading.refresh(grid, grid.integrate(view(TRUTH), TRUTH))
    for off in np.random.default_rng(0).uniform(-0.2, 0.2, (20, 3)):
        asked = in_room(reading, TRUTH, TRUTH @ Pose2.of(off), Pose2(), np.array([0.3, 0.3, 0.3]))
        search = Correlative(step=0.03)
        assert search.best(asked) == first_of_the_best(search, asked)


@pytest.mark.parametrize("beta", [0.2, 1.0])
def test_with_a_floor_all_that_reach_it_are_exact_and_no_other_is_above(beta: float) -> None:
    rng, reading, scan = np.random.default_rng(6), room(beta=beta), view(TRUTH)
    poses = np.array(TRUTH) + rng.normal(size=(300, 3)) * (0.05, 0.05, 0.05)
    values = reading.log_likelihood(scan, poses)
    for floor in np.sort(values)[::10]:
        asked = reading.log_likelihood(scan, poses, floor)
        np.testing.assert_array_equal(asked[values >= floor], values[values >= floor])
        below = asked[values < floor]
        assert ((below == -math.inf) | (below == values[values < floor])).all()
    assert np.isneginf(reading.log_likelihood(scan, poses, values.max())).sum() > 100


# -- the grid ----------------------------------------------------------------------------------


def asked_of(search: Correlative, deviations) -> np.ndarray:
    """The errors of the candidates."""
    reading = Plain()
    search.best(posterior(reading, Pose2(), deviations))
    return reading.asked[-1]


def test_the_grid_visits_zero_and_covers_its_reach_evenly() -> None:
    deviations = np.array([0.06, 0.08, 0.1])
    search = Correlative(step=0.03, turn=math.radians(1.0), reach=2.0)
    found = asked_of(search, deviations)
    assert [0.0, 0.0, 0.0] in found.tolist()
    for axis, step in enumerate((0.03, 0.03, math.radians(1.0))):
        ticks = np.unique(found[:, axis].round(9))
        np.testing.assert_allclose(np.diff(ticks), step, atol=1e-8)
        np.testing.assert_allclose(ticks, -ticks[::-1], atol=1e-12)
        assert 0.5 * step > 2.0 * deviations[axis] - ticks[-1] > -0.5 * step
    assert len(found) == len(np.unique(found.round(9), axis=0))


def test_a_robot_that_cannot_have_moved_is_looked_for_where_it_was() -> None:
    assert asked_of(Correlative(), np.full(3, 1e-6)).tolist() == [[0.0, 0.0, 0.0]]


def test_a_leap_of_the_odometry_does_not_drown_the_search() -> None:
    deviations = GaussianMotion().deviations(Pose2(500.0))
    assert len(candidates(Correlative(), deviations)) < 1_000_000
    asked = in_room(room(), TRUTH, TRUTH, Pose2(), deviations)
    assert math.dist(Correlative().best(asked)[:2], TRUTH[:2]) < 0.05


def test_the_best_candidate_is_refined() -> None:
    asked = in_room(room(), TRUTH, TRUTH @ Pose2(0.04, -0.06, 0.05), Pose2(), np.full(3, 0.1))
    search = Correlative()
    best = search.best(asked)
    found = search(asked, np.random.default_rng(0))
    assert found == search.refine.climb(asked, best) != best
    assert asked(np.array([found]))[0] > asked(np.array([best]))[0]
    alone = GaussNewton(levels=1)
    assert Correlative(refine=alone).refine is alone
