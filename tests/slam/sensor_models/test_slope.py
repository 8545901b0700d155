"""`slope`: the value, its gradient, and a negative semi-definite curvature."""

import numpy as np
import pytest

from slam.geometry import Pose2, transform_points
from slam.maps.static import Static
from slam.maps.tiles import TILE
from slam.sensor_models.beam import Beam
from slam.sensor_models.differences import STENCIL_STEPS, slope
from slam.sensor_models.endpoint import Endpoint
from slam.sensor_models.literal import Literal
from tests.slam import naive
from tests.slam.sensor_models.rooms import dense, mapped
from tests.slam.worlds import beam, scan_at

TRUTH = Pose2(0.2, 0.1, 0.5)
ENDPOINT = mapped(Static(), Endpoint())[1]
READINGS = [ENDPOINT, mapped(Static(), Beam())[1], mapped(Static(), Literal())[1]]
POSES = [Pose2(*(np.array(TRUTH) + e)) for e in
         np.random.default_rng(3).normal(0, (0.05, 0.05, 0.05), (15, 3))]  # fmt: skip


@pytest.mark.parametrize("reading", READINGS, ids=lambda r: type(r).__name__)
def test_its_value_is_the_likelihood_and_nothing_bends_up(reading) -> None:
    scan = scan_at(TRUTH)
    for pose in [TRUTH, *POSES]:
        value = reading.log_likelihood(scan, np.array([pose]))[0]
        assert reading.slope(scan, pose).value == pytest.approx(value, rel=1e-5)
        for level in range(reading.levels):
            found = reading.slope(scan, pose, level)
            np.testing.assert_allclose(found.curvature, found.curvature.T)
            values = np.linalg.eigvalsh(found.curvature)
            assert values.max() <= 1e-9 * abs(values).max()


def test_endpoints_gradient_is_that_of_finite_differences() -> None:
    endpoint, scan, step = ENDPOINT, scan_at(TRUTH), 1e-4
    for pose in POSES:
        steps = np.vstack([np.eye(3), -np.eye(3)]) * step
        values = endpoint.log_likelihood(scan, np.array(pose) + steps)
        differences = (values[:3] - values[3:]) / (2 * step)
        gradient = endpoint.slope(scan, pose).gradient
        np.testing.assert_allclose(gradient, differences, rtol=0.02, atol=0.3)


@pytest.mark.parametrize("level", [1, 2])
def test_the_coarser_levels_are_the_same_function_blurred(level: int) -> None:
    endpoint, scan = ENDPOINT, scan_at(TRUTH)
    step, tiles = 1e-3, endpoint.tiles
    field = dense(tiles, endpoint.field(level), TILE >> level)
    for pose in POSES:
        ahead = [endpoint.slope(scan, Pose2(*(np.array(pose) + e)), level).value
                 for e in np.vstack([np.eye(3), -np.eye(3)]) * step]  # fmt: skip
        differences = (np.array(ahead[:3]) - ahead[3:]) / (2 * step)
        found = endpoint.slope(scan, pose, level)
        np.testing.assert_allclose(found.gradient, differences, rtol=0.03, atol=0.4)
        points = transform_points(pose, scan.points) - tiles.origin
        read = sum(naive.spline(field, *(p / (0.05 * (1 << level)))) for p in points)
        assert found.value == pytest.approx(endpoint.beta * read, rel=1e-5)


def test_endpoints_curvature_on_an_isolated_peak_is_the_hessian() -> None:
    grid, endpoint = Static(), Endpoint(beta=1.0)
    pose = Pose2(0.525, 0.525)  # the echo comes from the middle of a cell
    for k in range(30):
        endpoint.refresh(grid, grid.integrate(beam(1.0, k), pose))
    scan = beam(1.0)
    steps = np.array([4e-3, 4e-3, 4e-3])
    at = lambda *e: endpoint.log_likelihood(scan, np.array([pose + np.array(e) * steps]))[0]  # noqa: E731
    hessian, unit = np.zeros((3, 3)), np.eye(3)
    for i in range(3):
        for j in range(3):
            a, b = unit[i], unit[j]
            hessian[i, j] = (at(*(a + b)) - at(*(a - b)) - at(*(b - a)) + at(*(-a - b))) / 4
    hessian /= np.outer(steps, steps)
    found = endpoint.slope(scan, pose)
    # free lane and unknown sides differ, so the peak of the spline is a little off the echo: the
    # gradient's share in the turn's curvature is left out
    hessian[2, 2] += found.gradient[0] * 1.0
    assert (np.diag(hessian) < -50)[[0, 1, 2]].all()
    np.testing.assert_allclose(found.curvature, hessian, rtol=0.02, atol=2.0)


def test_of_a_quadratic_function_the_differences_are_exact() -> None:
    rng = np.random.default_rng(0)
    root = rng.normal(size=(3, 3))
    hessian, gradient, pose = -root @ root.T, rng.normal(size=3), np.array([1.0, -2.0, 0.5])
    quadratic = lambda p: 7 + (p - pose) @ gradient + 0.5 * np.einsum(  # noqa: E731
        "ni,ij,nj->n", p - pose, hessian, p - pose)  # fmt: skip
    found = slope(quadratic, Pose2(*pose))
    assert found.value == 7
    np.testing.assert_allclose(found.gradient, gradient)
    np.testing.assert_allclose(found.curvature, hessian, atol=1e-7)


def test_what_bends_up_is_left_out() -> None:
    saddle = lambda p: p[:, 0] ** 2 - 2 * p[:, 1] ** 2  # noqa: E731
    found = slope(saddle, Pose2())
    np.testing.assert_allclose(found.curvature, np.diag([0.0, -4.0, 0.0]), atol=1e-9)
    assert slope(lambda p: np.zeros(len(p)), Pose2()).curvature.any() == False  # noqa: E712
    assert STENCIL_STEPS[0] == STENCIL_STEPS[1] == 0.02
