"""Gauss-Newton climbs to the maximum of the peak that it starts on."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slam.geometry import Pose2, compose
from slam.interface import Posterior, Slope
from slam.motion.gaussian import Prediction
from slam.search.gauss_newton import GaussNewton, _ascended
from slam.sensor_models.endpoint import Endpoint
from tests.slam.search.maps import in_room, room, view
from tests.slam.search.objectives import WIDTH, Peaks, Plain, posterior
from tests.slam.worlds import beam

TRUTH = Pose2(0.717, -0.344, 2.2)
WIDE = np.array([0.3, 0.3, 0.3])
RNG = np.random.default_rng(0)  # it draws nothing


def climbed(asked: Posterior, start: Pose2, **options) -> Pose2:
    return GaussNewton(**options).climb(asked, start)


def away(a: Pose2, b: Pose2) -> tuple[float, float]:
    """m and degrees."""
    error = a.between(b)
    return math.hypot(error.x, error.y), abs(math.degrees(error.theta))


def value(asked: Posterior, pose: Pose2) -> float:
    return float(asked(np.array([pose]))[0])


near = st.floats(-0.04, 0.04)


@settings(max_examples=20)
@given(off=st.tuples(near, near, near))
@pytest.mark.parametrize("model", ["static", "histogram"])
def test_it_ends_at_the_top_of_the_peak(model, off) -> None:
    start = TRUTH @ Pose2.of(off)
    asked = in_room(room(model=model), TRUTH, start, Pose2(), WIDE)
    end = GaussNewton(levels=1)(asked, RNG)
    fine = np.linspace(-1, 1, 9)
    errors = np.stack(np.meshgrid(fine * 0.003, fine * 0.003, fine * 0.003), -1).reshape(-1, 3)
    around = asked(compose(end, errors))
    assert value(asked, end) > around.max() - 0.002
    assert np.abs(errors[around.argmax()]).max() < 0.0008


@settings(max_examples=40)
@given(off=st.tuples(*[st.floats(-0.5, 0.5)] * 3), start=st.tuples(*[st.floats(-1, 1)] * 3))
def test_it_never_ends_lower_than_it_began(off, start) -> None:
    asked = in_room(room(), TRUTH, TRUTH @ Pose2.of(off), Pose2(), WIDE)
    begin = TRUTH @ Pose2.of(start)
    assert value(asked, climbed(asked, begin, levels=1)) >= value(asked, begin) - 1e-4


def test_every_step_leads_up() -> None:
    asked = in_room(room(), TRUTH, TRUTH @ Pose2(0.1, -0.1, 0.1), Pose2(), WIDE)
    start = asked.prediction.pose
    last = asked.slope(start).value
    for steps in range(1, 8):
        value = asked.slope(climbed(asked, start, levels=1, steps=steps)).value
        assert value >= last
        last = value


@pytest.mark.parametrize("level", [0, 1])
@pytest.mark.parametrize("off", [Pose2(0.1, -0.1, 0.1), Pose2(-0.4, 0.2, 0.3)])
def test_the_compiled_climb_ends_where_that_of_any_sensor_model_does(off: Pose2, level) -> None:
    asked = in_room(room(), TRUTH, TRUTH @ off, Pose2(), WIDE)
    climb, start = GaussNewton(), asked.prediction.pose
    pose, here = climb._climb(asked, start, level)
    plain, there = _ascended(asked, start, level, climb.steps, climb.precision)
    np.testing.assert_allclose(pose, plain, atol=1e-9)
    for mine, other in zip(here, there, strict=True):
        np.testing.assert_allclose(mine, other, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("start", [Pose2(), Pose2(1.0, -2.0, 3.1), Pose2(-3.0, 0.0, -3.14)])
def test_a_paraboloid_is_climbed_at_one_step(start: Pose2) -> None:
    peak = np.array(start) + (0.03, -0.02, 0.07)
    reading = Peaks(peak)
    asked = posterior(reading, start)
    end = climbed(asked, start, steps=1)
    prior = Prediction(start, Pose2(), asked.prediction.deviations)
    expected = np.array(start) + (peak - start) / (1 + WIDTH**2 / prior.deviations**2)
    assert away(end, Pose2.of(expected)) == pytest.approx((0, 0), abs=1e-6)
    assert -math.pi <= end.theta <= math.pi


@pytest.mark.parametrize("seed", range(5))
def test_one_step_solves_any_quadratic(seed: int) -> None:
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(3, 3)) * (10.0, 20.0, 5.0)
    curvature, peak = -(root @ root.T + np.eye(3)), rng.uniform(-0.2, 0.2, 3)
    asked = posterior(Plain())

    def quadratic(pose, level=0):
        error = np.array(pose) - peak
        return Slope(float(0.5 * error @ curvature @ error), curvature @ error, curvature)

    asked.slope = quadratic  # pyright: ignore
    assert climbed(asked, Pose2(), steps=1, levels=1) == pytest.approx(tuple(peak), abs=1e-5)


def test_a_start_at_the_peak_is_kept() -> None:
    start = Pose2(1.0, -2.0, 3.1)
    assert climbed(posterior(Peaks(start), start), start) == start


def test_where_nothing_is_seen_it_ends_where_the_odometry_leads() -> None:
    for displacement in (Pose2(), Pose2(0.3, 0.1, 1.0)):
        asked = posterior(Plain(), Pose2(1.0, 2.0, 3.0), (0.1, 0.1, 0.3), displacement)
        assert GaussNewton()(asked, RNG) == asked.prediction.pose
        back = climbed(asked, asked.prediction.pose @ Pose2(0.1, -0.1, 0.2))
        assert away(back, asked.prediction.pose) == pytest.approx((0, 0), abs=1e-3)


@pytest.mark.parametrize("scan", ["no echo", "nothing known"])
def test_without_echoes_or_a_map_there_it_ends_where_the_odometry_leads(scan: str) -> None:
    start = TRUTH if scan == "no echo" else Pose2(500.0, 500.0)
    asked = Posterior(
        room(),
        beam(math.inf) if scan == "no echo" else view(TRUTH),
        Prediction(start, Pose2(), WIDE),
    )
    assert GaussNewton()(asked, RNG) == start
    assert away(climbed(asked, start @ Pose2(0.1, 0.05, 0.1)), start) == pytest.approx(
        (0, 0), abs=1e-3
    )


def test_a_posterior_without_slope_and_curvature_is_not_climbed() -> None:
    asked = posterior(Plain())
    asked.slope = lambda pose, level=0: Slope(0.0, np.zeros(3), np.zeros((3, 3)))  # pyright: ignore
    assert climbed(asked, TRUTH) == TRUTH


OFFSETS = [
    Pose2(0.1 * math.cos(a), 0.1 * math.sin(a), turn)
    for a in np.arange(0, math.tau, math.tau / 8)
    for turn in (-math.radians(5.0), math.radians(5.0))
]


def found_from(factor: float, levels: int) -> int:
    """The number of offsets, scaled by a factor, from which the truth is found."""
    count = 0
    for off in OFFSETS:
        start = TRUTH @ Pose2.of(np.array(off) * factor)
        asked = in_room(room(), TRUTH, start, Pose2(), 3 * WIDE)
        metres, degrees = away(GaussNewton(levels=levels)(asked, RNG), TRUTH)
        count += metres < 0.02 and degrees < 0.7
    return count


def test_from_ten_centimetres_and_five_degrees_all_levels_together_find_home() -> None:
    assert found_from(1.0, levels=3) == len(OFFSETS)


def test_coarse_levels_find_home_from_farther() -> None:
    alone, two, three = (found_from(4.0, levels) for levels in (1, 2, 3))
    assert alone < two < three
    assert alone <= len(OFFSETS) // 4
    assert three >= len(OFFSETS) // 2


def test_it_goes_from_coarse_to_fine_through_no_more_levels_than_there_are() -> None:
    asked = in_room(room(), TRUTH, TRUTH @ Pose2(0.05, 0.0, 0.02), Pose2(), WIDE)
    levels, model = [], asked.sensor_model
    assert isinstance(model, Endpoint)
    reading = model.reading

    def noted(level):
        levels.append(level)
        return reading(level)

    model.reading = noted  # pyright: ignore
    for asked_for, expected in ((1, [0]), (2, [1, 0]), (3, [2, 1, 0]), (9, [2, 1, 0])):
        levels.clear()
        GaussNewton(levels=asked_for)(asked, RNG)
        assert list(dict.fromkeys(levels)) == expected


def test_the_precision_is_the_last_step() -> None:
    reading = Peaks((0.1, 0.0, 0.0))
    asked = posterior(reading)
    assert climbed(asked, Pose2(), precision=0.2) == Pose2()
    assert climbed(asked, Pose2(), precision=0.05).x == pytest.approx(0.1, abs=1e-4)
