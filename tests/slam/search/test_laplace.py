import numpy as np
import pytest

from slam.geometry import Pose2
from slam.search.laplace import STEPS, laplace_covariance

POSE = Pose2(2.0, -1.0, 0.7)
DEVIATIONS = 5 * STEPS


def gaussian(covariance):
    information = np.linalg.inv(covariance)

    def objective(poses):
        errors = poses - np.array(POSE)
        return 7.0 - 0.5 * np.einsum("ni,ij,nj->n", errors, information, errors)

    return objective


@pytest.mark.parametrize("seed", range(5))
def test_a_gaussian_gives_its_covariance(seed: int) -> None:
    root = np.random.default_rng(seed).normal(size=(3, 3)) * 0.5 * STEPS[:, None]
    covariance = root @ root.T + np.diag(STEPS**2) * 0.1
    found = laplace_covariance(gaussian(covariance), POSE, DEVIATIONS)
    np.testing.assert_allclose(found, covariance, rtol=1e-6, atol=1e-12)


@pytest.mark.parametrize("flat", range(3))
def test_a_flat_direction_keeps_the_deviation_of_the_motion(flat: int) -> None:
    def objective(poses):
        errors = (poses - np.array(POSE)) / STEPS
        errors[:, flat] = 0.0
        return -0.5 * (errors**2).sum(axis=1)

    expected = np.array(STEPS) ** 2
    expected[flat] = DEVIATIONS[flat] ** 2
    found = laplace_covariance(objective, POSE, DEVIATIONS)
    np.testing.assert_allclose(found, np.diag(expected), rtol=1e-6, atol=1e-12)


def test_a_saddle_still_gives_a_covariance() -> None:
    def objective(poses):
        x, y, theta = ((poses - np.array(POSE)) / STEPS).T
        return x**2 - y**2 - theta**2

    found = laplace_covariance(objective, POSE, DEVIATIONS)
    assert (np.linalg.eigvalsh(found) > 0).all()
    assert found[0, 0] == pytest.approx(DEVIATIONS[0] ** 2)
