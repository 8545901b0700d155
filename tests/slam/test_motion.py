import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import multivariate_normal

from slam.geometry import Pose2, compose
from slam.motion import OdometryMotion, log_prior


def test_log_prior_is_a_gaussian_in_the_predicted_frame() -> None:
    rng = np.random.default_rng(0)
    predicted, deviations = Pose2(3.0, -2.0, 2.5), np.array([0.1, 0.03, 0.2])
    errors = rng.normal(size=(50, 3)) * deviations
    found = log_prior(compose(predicted, errors), np.array(predicted), deviations)
    normal = multivariate_normal(cov=np.diag(deviations**2))  # pyright: ignore[reportArgumentType]
    expected = normal.logpdf(errors) - normal.logpdf(np.zeros(3))
    np.testing.assert_allclose(found, expected, atol=1e-9)


def test_log_prior_counts_headings_the_short_way() -> None:
    predicted, deviations = np.array([0.0, 0.0, math.pi - 0.01]), np.full(3, 0.1)
    found = log_prior(np.array([[0.0, 0.0, -math.pi + 0.01]]), predicted, deviations)
    assert found[0] == pytest.approx(-0.5 * 0.2**2)


def test_deviations_by_hand() -> None:
    model = OdometryMotion(0.1, 0.05, 0.01, 0.5, 0.2, 0.02)
    translation = math.sqrt(0.2**2 + 0.025**2 + 0.01**2)
    rotation = math.sqrt(1.0**2 + 0.1**2 + 0.02**2)
    found = model.deviations(Pose2(1.2, -1.6, -0.5))
    np.testing.assert_allclose(found, [translation, translation, rotation])


moved = st.floats(0, 3)


@given(moved, moved, st.floats(1.01, 3))
def test_deviations_grow_with_what_was_moved(way: float, turn: float, factor: float) -> None:
    model = OdometryMotion()
    little = model.deviations(Pose2(way, 0.0, turn))
    assert (model.deviations(Pose2(way * factor, 0.0, turn)) >= little).all()
    assert (model.deviations(Pose2(way, 0.0, turn * factor)) >= little).all()
    assert (little >= model.deviations(Pose2())).all()
    assert (model.deviations(Pose2(way + 0.1, 0.0, turn + 0.1)) > little).all()


def test_the_default_is_as_wide_as_the_papers_systematic_error() -> None:
    assert OdometryMotion().deviations(Pose2(0.05, 0.0, 0.0))[2] >= math.radians(3.0)
