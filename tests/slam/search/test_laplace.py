import numpy as np
import pytest

from slam.geometry import Pose2
from slam.search.laplace import NARROW_STEPS, laplace, wide_information
from tests.slam.search.maps import room, view
from tests.slam.search.objectives import Plain
from tests.slam.worlds import beam

POSE = Pose2(2.0, -1.0, 0.7)


class Shape(Plain):
    """A log-likelihood of any shape, the errors from POSE given in units of the NARROW_STEPS."""

    def __init__(self, function):
        super().__init__()
        self.function = function

    def _values(self, poses):
        return self.function((poses - np.array(POSE)) / NARROW_STEPS)


def found(function) -> tuple[float, np.ndarray]:
    """The value, and the information in units of the NARROW_STEPS."""
    value, information = laplace(Shape(function), beam(1.0), POSE)
    return value, information * np.outer(NARROW_STEPS, NARROW_STEPS)


@pytest.mark.parametrize("seed", range(5))
def test_a_gaussian_holds_the_inverse_of_its_covariance(seed: int) -> None:
    root = np.random.default_rng(seed).normal(size=(3, 3)) * 0.5
    expected = np.linalg.inv(root @ root.T + np.eye(3) * 0.1)

    def gaussian(errors):
        return 7.0 - 0.5 * np.einsum("ni,ij,nj->n", errors, expected, errors)

    value, information = found(gaussian)
    assert value == pytest.approx(7.0)
    np.testing.assert_allclose(information, expected, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize("flat", range(3))
def test_a_flat_direction_holds_no_information(flat: int) -> None:
    def ridge(errors):
        return -0.5 * (np.delete(errors, flat, axis=1) ** 2).sum(axis=1)

    expected = np.eye(3)
    expected[flat, flat] = 0.0
    np.testing.assert_allclose(found(ridge)[1], expected, atol=1e-9)


def test_a_saddle_holds_none_where_it_bends_up() -> None:
    def saddle(errors):
        x, y, theta = errors.T
        return x**2 - y**2 - theta**2

    np.testing.assert_allclose(found(saddle)[1], np.diag([0.0, 2.0, 2.0]), atol=1e-9)


def test_where_it_levels_off_no_two_axes_are_bound_together() -> None:
    """A likelihood of the distance alone has the same information in all directions."""

    def bell(errors):
        return 4.0 * np.exp(-0.02 * np.square(errors).sum(axis=1))

    information = wide_information(Shape(bell), beam(1.0), POSE) * np.outer(
        NARROW_STEPS, NARROW_STEPS
    )
    assert information[0, 0] > 0.1
    np.testing.assert_allclose(information, information[0, 0] * np.eye(3), atol=1e-6)


def test_more_weight_of_the_beams_is_more_information() -> None:
    truth = Pose2(0.717, -0.344, 2.2)
    tempered, full = (laplace(room(beta=beta), view(truth), truth) for beta in (0.2, 1.0))
    assert full[0] == pytest.approx(5 * tempered[0])
    np.testing.assert_allclose(full[1], 5 * tempered[1], rtol=1e-6)
    assert (np.sqrt(np.diag(np.linalg.inv(full[1]))) < (0.02, 0.02, 0.01)).all()


def test_a_scan_without_echoes_knows_nothing() -> None:
    value, information = laplace(room(), beam(np.inf), POSE)
    assert value == 0.0
    assert not information.any()
