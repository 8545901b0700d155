import math

import numpy as np
import pytest

from slam.errors import InputError
from slam.geometry import Pose2, compose, transform_points
from slam.maps.histogram import Histogram
from slam.maps.static import Static
from slam.perception.endpoint import MOVED, Endpoint
from tests.slam import naive
from tests.slam.worlds import FAN, beam, loop, scan_at


def mapped(grid, endpoint: Endpoint, poses, angles=FAN):
    """The room, mapped from poses that are true, the field brought up to date scan by scan."""
    for k, pose in enumerate(poses):
        pose = Pose2.of(pose)
        scan = scan_at(pose, time=1.7 * k, angles=angles)
        endpoint.refresh(grid, grid.integrate(scan, pose))
    return grid, endpoint


def rebuilt(grid, endpoint: Endpoint) -> np.ndarray:
    """The field anew, from the whole map and the centroids that the reading believes in."""
    h = np.clip(grid.occupied, endpoint.H_MIN, endpoint.H_MAX)
    known = np.dstack([h, endpoint.known[..., 1:]])
    return naive.field(known, grid.centroids.count, grid.spec.resolution, endpoint.sigma,
                       endpoint.z_hit, endpoint.z_rand)  # fmt: skip


@pytest.mark.parametrize("model", [Static, Histogram])
@pytest.mark.parametrize("sigma", [0.05, 0.08])
def test_the_field_kept_up_to_date_is_the_field_rebuilt(model, sigma: float) -> None:
    grid, endpoint = mapped(model(), Endpoint(sigma=sigma), loop(12))
    np.testing.assert_allclose(endpoint.field, rebuilt(grid, endpoint), atol=1e-5)
    assert np.abs(endpoint.known[..., 1:] - grid.centroids.offset).max() < MOVED


def test_the_field_follows_a_map_that_grows_every_way() -> None:
    poses = [(0, 0, 0), (3, 0, 1), (0, 3, 2), (-3, 0, 3), (0, -3, 4), (0, 0, 5)]
    grid, endpoint = Static(), Endpoint()
    for pose in poses:
        scan = scan_at(Pose2(0.1, 0.1))
        endpoint.refresh(grid, grid.integrate(scan, Pose2.of(pose)))
    assert grid.spec.row0 < -64
    assert endpoint.field.shape == grid.spec.shape
    np.testing.assert_allclose(endpoint.field, rebuilt(grid, endpoint), atol=1e-5)


def test_an_echo_at_the_maps_border_reaches_over_it_when_the_map_grows() -> None:
    grid, endpoint = Static(), Endpoint()
    for y, x_end in ((0.52, 3.18), (2.52, 4.5)):  # the border is at 64 cells = 3.2 m, then farther
        endpoint.refresh(grid, grid.integrate(beam(x_end - 0.5), Pose2(0.5, y)))
    assert grid.spec.cols == 128
    np.testing.assert_allclose(endpoint.field, rebuilt(grid, endpoint), atol=1e-5)


def test_the_score_is_the_sum_of_the_spline_over_the_echoes() -> None:
    grid, endpoint = mapped(Static(), Endpoint(beta=0.3), loop(8))
    scan, poses = scan_at(Pose2(0.3, 0.1, 0.4)), np.random.default_rng(2).normal(size=(10, 3))
    origin, resolution = grid.spec.origin, grid.spec.resolution
    rows, cols = grid.spec.shape
    expected = []
    for pose in poses:
        total = 0.0
        for x, y in (transform_points(Pose2.of(pose), scan.points) - origin) / resolution:
            if 1 <= x < cols - 1 and 1 <= y < rows - 1:
                total += naive.spline(endpoint.field, x, y)
            else:
                total += math.log(0.95 * grid.prior + 0.05)
        expected.append(0.3 * total)
    np.testing.assert_allclose(endpoint.log_likelihood(scan, poses), expected, rtol=1e-5)


def test_one_echo_on_one_known_wall_by_hand() -> None:
    grid, endpoint = Static(), Endpoint(beta=1.0)
    pose = Pose2(0.525, 0.525)
    for k in range(50):
        endpoint.refresh(grid, grid.integrate(beam(1.0, k), pose))
    on_it, beside, unseen = np.array(pose), np.array(pose) + (0, 0.5, 0), np.array(pose) + 1.2
    found = endpoint.log_likelihood(beam(1.0), np.array([on_it, beside, unseen]))
    # the smoothed peak lies a little below log(0.95 x 0.98 + 0.05); nothing is known elsewhere
    assert math.log(0.5) < found[0] < math.log(0.95 * 0.98 + 0.05)
    assert found[1:] == pytest.approx([math.log(0.95 * 0.2 + 0.05)] * 2, abs=1e-5)


def test_points_outside_the_map_count_as_unknown() -> None:
    _, endpoint = mapped(Static(), Endpoint(), loop(3))
    scan = scan_at(Pose2(0.1, 0.1))
    found = endpoint.log_likelihood(scan, np.array([[500.0, -500.0, 0.0]]))[0]
    assert found == pytest.approx(0.2 * len(scan.points) * math.log(0.95 * 0.2 + 0.05))


@pytest.mark.parametrize("model", [Static, Histogram])
def test_the_likelihood_peaks_at_the_truth(model) -> None:
    _, endpoint = mapped(model(), Endpoint(), loop(20))
    truth = Pose2(0.217, -0.144, 2.2)
    steps = np.arange(-8, 9) * 0.0125
    turns = np.radians(np.arange(-8, 9) * 0.5)
    errors = np.stack(np.meshgrid(steps, steps, turns), axis=-1).reshape(-1, 3)
    scores = endpoint.log_likelihood(scan_at(truth), compose(truth, errors))
    best = errors[scores.argmax()]
    assert np.abs(best[:2]).max() <= 0.0125
    assert abs(best[2]) <= np.radians(0.5)
    assert scores.max() - scores.min() > 3


def test_beta_only_scales() -> None:
    scan, poses = scan_at(Pose2()), np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.1]])
    tempered = mapped(Static(), Endpoint(), loop(3))[1].log_likelihood(scan, poses)
    paper = mapped(Static(), Endpoint(beta=1.0), loop(3))[1].log_likelihood(scan, poses)
    np.testing.assert_allclose(paper, tempered / 0.2)


@pytest.mark.parametrize("name", ["beta", "sigma", "z_hit", "z_rand"])
def test_what_is_not_positive_is_refused(name: str) -> None:
    with pytest.raises(InputError, match=f"Endpoint.{name} must be"):
        Endpoint(**{name: 0.0})


def test_cells_of_a_metre_are_as_good_as_others() -> None:
    grid, endpoint = Static(1.0), Endpoint(sigma=1.0)
    endpoint.refresh(grid, grid.integrate(beam(3.0), Pose2(0.5, 0.5)))
    np.testing.assert_allclose(endpoint.field, rebuilt(grid, endpoint), atol=1e-5)


@pytest.mark.parametrize(("column", "known"), [(1.5, True), (1.0, True), (0.9, False)])
def test_the_outermost_cells_cannot_be_read_between(column: float, known: bool) -> None:
    grid, endpoint = Static(), Endpoint(beta=1.0)
    for k in range(3):
        to_the_border = beam(0.525, k, angle=math.pi)
        endpoint.refresh(grid, grid.integrate(to_the_border, Pose2(0.6, 0.6)))
    assert grid.spec.origin == (0.0, 0.0)
    pose = np.array([[column * 0.05 + 1.0, 0.6, 0.0]])
    found = endpoint.log_likelihood(beam(1.0, angle=math.pi), pose)[0]
    read = naive.spline(endpoint.field, column, 12.0)
    assert abs(read - endpoint.unknown) > 0.01
    assert found == pytest.approx(read if known else endpoint.unknown, abs=1e-5)
