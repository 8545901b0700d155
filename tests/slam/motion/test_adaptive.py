import math
from typing import Any

import numpy as np
import pytest

from slam.errors import InputError
from slam.geometry import Pose2
from slam.motion.adaptive import AdaptiveOdometry
from slam.motion.gaussian import GaussianMotion
from slam.motion.long_errors import FEW, LONG, WINDOW, LongErrors

EXACT = np.zeros((3, 3))
WIDE = math.radians(120.0)


def taught(error_per_m: float, step: float = 0.1, way: float = 10.0) -> AdaptiveOdometry:
    model = AdaptiveOdometry()
    for k in range(round(way / step)):
        sign = 1.0 if k % 2 else -1.0
        model.learn(Pose2(step, 0.0, 0.0), Pose2(step, 0.0, sign * error_per_m * step), EXACT)
    return model


def rate(model: AdaptiveOdometry, step: float = 1.0) -> float:
    """rad/m, the deviation by distance alone."""
    still = model.deviations(Pose2())[2]
    return math.sqrt(model.deviations(Pose2(step, 0.0, 0.0))[2] ** 2 - still**2) / step


def test_it_begins_as_wide_as_the_papers_odometry_needs() -> None:
    assert rate(AdaptiveOdometry()) == pytest.approx(WIDE)
    np.testing.assert_array_equal(
        AdaptiveOdometry().deviations(Pose2(0.3, 0.1, 0.5)),
        GaussianMotion().deviations(Pose2(0.3, 0.1, 0.5)),
    )


def test_it_narrows_to_the_least_where_the_odometry_is_good() -> None:
    assert rate(taught(0.0, way=20.0)) == pytest.approx(math.radians(8.0))


def test_it_stays_wide_where_the_odometry_is_bad() -> None:
    assert rate(taught(math.radians(60.0))) > math.radians(100.0)
    assert rate(taught(math.radians(1000.0))) == pytest.approx(WIDE)


def test_it_follows_what_was_found_lately() -> None:
    model = taught(0.0, way=20.0)
    for _ in range(30):
        model.learn(Pose2(0.1, 0.0, 0.0), Pose2(0.1, 0.0, math.radians(6.0)), EXACT)
    assert rate(model) > math.radians(80.0)


def test_the_rate_is_that_of_the_errors_between_the_limits() -> None:
    model = taught(math.radians(30.0), step=0.5, way=40.0)
    floor = GaussianMotion().rotation_floor
    found = math.sqrt((math.radians(15.0) ** 2 - floor**2) / 0.25)
    assert model.rate == pytest.approx(found, rel=1e-3)
    assert rate(model) == pytest.approx(2.0 * found, rel=1e-3)


def scaled(error: float, step: float = 0.2, way: float = 4.0, deviation: float = 0.01):
    """A model that was taught distances that are wrong by `error`, in a direction of its own."""
    model, rng = AdaptiveOdometry(), np.random.default_rng(0)
    covariance = np.diag([deviation, deviation, 0.01]) ** 2
    for _ in range(round(way / step)):
        measured = (1.0 + error) * step + rng.normal(0.0, deviation)
        model.learn(Pose2(0.0, step, 0.0), Pose2(0.0, measured, 0.0), covariance)
    return model


@pytest.mark.parametrize("error", [-0.17, 0.2])
def test_wrong_distances_are_corrected_once_they_are_certain(error: float) -> None:
    corrected = scaled(error).corrected(Pose2(1.0, 2.0, 0.3))
    assert corrected == pytest.approx((1.0 + error, 2.0 + 2.0 * error, 0.3), abs=0.05)
    assert scaled(error, way=0.2).corrected(Pose2(1.0, 0.0, 0.0)) == Pose2(1.0, 0.0, 0.0)


def test_small_errors_of_distances_and_slips_are_not() -> None:
    assert scaled(0.03).corrected(Pose2(1.0, 0.0, 0.0)) == Pose2(1.0, 0.0, 0.0)
    assert scaled(-0.9).systematic.scale.error == 0.0


def test_no_scale_is_learned_where_the_scan_tells_nothing() -> None:
    model = scaled(0.2, deviation=float(GaussianMotion().deviations(Pose2(0.0, 0.2, 0.0))[0]))
    assert model.systematic.scale.error == 0.0


def test_errors_of_a_long_displacement_grow_with_its_square_root() -> None:
    model = AdaptiveOdometry()
    one, four = (model.deviations(Pose2(d, 0.0, 0.0)) for d in (LONG, 4.0 * LONG))
    assert four == pytest.approx(2.0 * one, rel=0.02)


def test_no_displacement_is_corrected_and_turns_on_the_spot_teach_nothing() -> None:
    model = taught(math.radians(60.0))
    assert model.corrected(Pose2(0.1, 0.2, 0.3)) == Pose2(0.1, 0.2, 0.3)
    before = model.rate
    model.learn(Pose2(0.0, 0.0, 1.0), Pose2(0.0, 0.0, 0.2), EXACT)
    assert model.rate == before


@pytest.mark.parametrize("bad", [{"least": 0.0}, {"width": -1.0}, {"memory": math.inf}])
def test_bad_parameters_are_refused(bad: dict[str, Any]) -> None:
    with pytest.raises(InputError, match=rf"AdaptiveOdometry\.{next(iter(bad))}"):
        AdaptiveOdometry(**bad)


def noisy(step: float, way: float) -> AdaptiveOdometry:
    """A model of an odometry whose errors are noise of each step, 0.5 mm and 2 degrees."""
    model, rng = AdaptiveOdometry(), np.random.default_rng(0)
    for _ in range(round(way / step)):
        found = Pose2(step, *rng.normal(0.0, [5e-4, math.radians(2.0)]).tolist())
        model.learn(Pose2(step, 0.0, 0.0), found, EXACT)
    return model


def test_noise_of_keyframes_does_not_widen_long_displacements() -> None:
    model, drive = noisy(0.1, 6.0), Pose2(4.0, 0.0, 0.0)
    heading = math.radians(2.0) * math.sqrt(40.0)  # that the noise of 40 steps adds up to
    assert math.degrees(model.rate * 4.0) > 60.0
    assert heading < model.deviations(drive)[2] < 4.0 * heading
    assert (model.deviations(drive)[:2] < 0.5 * GaussianMotion().deviations(drive)[:2]).all()
    short = Pose2(0.2, 0.0, 0.1)
    np.testing.assert_array_equal(
        model.deviations(short)[:2], GaussianMotion().deviations(short)[:2]
    )


def test_a_bias_widens_them() -> None:
    model = AdaptiveOdometry()
    for _ in range(60):
        model.learn(Pose2(0.1, 0.0, 0.0), Pose2(0.1, 0.0, math.radians(1.5)), EXACT)
    assert model.deviations(Pose2(4.0, 0.0, 0.0))[2] > math.radians(60.0)


def test_few_windows_and_long_displacements_teach_nothing_about_long_ones() -> None:
    errors, step = LongErrors(), Pose2(WINDOW, 0.0, 0.0)
    for _ in range(FEW - 1):
        errors.learn(step, step)
        errors.learn(Pose2(LONG, 0.0, 0.0), Pose2())
    assert np.isinf(errors.deviations(LONG)).all()
    errors.learn(step, step)
    assert (errors.deviations(LONG) < 0.1).all()
