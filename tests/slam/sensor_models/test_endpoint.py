import math

import numpy as np
import pytest

from slam.errors import InputError
from slam.geometry import Pose2, compose, transform_points
from slam.maps.histogram import Histogram
from slam.maps.static import Static
from slam.scan import Scan
from slam.sensor_models.endpoint import Endpoint
from slam.sensor_models.field import H_MIN
from tests.slam import naive
from tests.slam.sensor_models.rooms import around, mapped
from tests.slam.worlds import FAN, beam, loop, scan_at


def test_the_score_is_the_sum_of_the_spline_over_the_echoes() -> None:
    grid, endpoint = mapped(Static(), Endpoint(beta=0.3), loop(8))
    tiles = grid.cells.tiles
    scan = scan_at(Pose2(0.3, 0.1, 0.4), mount=Pose2(0.2, 0.05, 0.1))
    poses = np.random.default_rng(2).normal(size=(30, 3))
    field = tiles.dense(endpoint.field(0))
    rows, cols = field.shape
    expected = []
    for pose in poses:
        total = 0.0
        for x, y in (transform_points(Pose2.of(pose), scan.points) - tiles.origin) / 0.05:
            if 1 <= x < cols - 1 and 1 <= y < rows - 1:
                total += naive.spline(field, x, y)
            else:
                total += math.log(0.9 * 0.2 + 0.1)
        expected.append(0.3 * total)
    np.testing.assert_allclose(endpoint.log_likelihood(scan, poses), expected, rtol=1e-5)


def test_one_echo_on_one_known_wall_by_hand() -> None:
    grid, endpoint = Static(), Endpoint(beta=1.0)
    pose = Pose2(0.525, 0.525)
    for k in range(50):
        endpoint.refresh(grid, grid.integrate(beam(1.0, k), pose))
    on_it, free, unseen = np.array(pose), np.array(pose) - (0.5, 0, 0), np.array(pose) + 1.2
    found = endpoint.log_likelihood(beam(1.0), np.array([on_it, free, unseen]))
    # the smoothed peak lies a little below log(0.9 x 0.98 + 0.1); the free lane is a cell wide
    assert math.log(0.5) < found[0] < math.log(0.9 * 0.98 + 0.1)
    lane = 0.75 * math.log(0.9 * H_MIN / 255 + 0.1) + 0.25 * math.log(0.9 * 0.2 + 0.1)
    assert found[1] == pytest.approx(lane, abs=2e-3)
    assert found[2] == pytest.approx(math.log(0.9 * 0.2 + 0.1), abs=1e-5)


def test_points_outside_the_map_count_as_unknown() -> None:
    _, endpoint = mapped(Static(), Endpoint(), loop(3))
    scan = scan_at(Pose2(0.1, 0.1))
    unknown = 0.3 * len(scan.points) * math.log(0.9 * 0.2 + 0.1)
    for pose in ([500.0, -500.0, 0.0], [-1e6, 3.0, 1.0]):
        found = endpoint.log_likelihood(scan, np.array([pose]))[0]
        assert found == pytest.approx(unknown)
        slope = endpoint.slope(scan, Pose2.of(pose))
        assert slope.value == pytest.approx(unknown)
        assert not slope.gradient.any()


def test_whatever_is_no_echo_says_nothing() -> None:
    _, endpoint = mapped(Static(), Endpoint(), loop(3))
    scan, poses = scan_at(Pose2(0.1, 0.1)), np.array([[0.1, 0.1, 0.0]])
    ranges = np.concatenate([scan.ranges, [np.nan, np.inf, 6.0, 7.0, 0.0, -1.0]])
    more = Scan(ranges, np.concatenate([scan.angles, np.zeros(6)]), 6.0)
    assert endpoint.log_likelihood(more, poses) == endpoint.log_likelihood(scan, poses)
    empty = Scan(np.zeros(0), np.zeros(0), 6.0)
    assert endpoint.log_likelihood(empty, poses) == 0.0
    assert endpoint.slope(empty, Pose2()).value == 0.0
    assert endpoint.log_likelihood(scan, np.zeros((0, 3))).shape == (0,)


@pytest.mark.parametrize("model", [Static, Histogram])
def test_the_likelihood_peaks_at_the_truth(model) -> None:
    _, endpoint = mapped(model(), Endpoint())
    truth = Pose2(0.217, -0.144, 2.2)
    errors = around(truth)
    scores = endpoint.log_likelihood(scan_at(truth), compose(truth, errors))
    best = errors[scores.argmax()]
    assert np.abs(best[:2]).max() <= 0.0125
    assert abs(best[2]) <= np.radians(0.5)
    assert scores.max() - scores.min() > 3


def test_beta_only_scales() -> None:
    scan, poses = scan_at(Pose2()), np.array([[0.0, 0.0, 0.0], [0.3, 0.0, 0.1]])
    tempered = mapped(Static(), Endpoint(), loop(3))[1]
    paper = mapped(Static(), Endpoint(beta=1.0), loop(3))[1]
    for beta, reading in ((0.3, tempered), (1.0, paper)):
        scale = beta / 0.3
        np.testing.assert_allclose(
            reading.log_likelihood(scan, poses), scale * tempered.log_likelihood(scan, poses)
        )
        for a, b in zip(reading.slope(scan, Pose2()), tempered.slope(scan, Pose2()), strict=True):
            np.testing.assert_allclose(a, scale * b)


@pytest.mark.parametrize("z_hit", [0.9, 2.0])
def test_above_the_floor_nothing_changes_and_below_it_nothing_is_missed(z_hit: float) -> None:
    _, endpoint = mapped(Static(), Endpoint(z_hit=z_hit), loop(8))
    scan = scan_at(Pose2(0.1, 0.2, 0.3))
    poses = (0.1, 0.2, 0.3) + np.random.default_rng(1).normal(0, (0.1, 0.1, 0.1), (200, 3))
    values = endpoint.log_likelihood(scan, poses)
    for floor in (values.max(), np.median(values), values.min()):
        found = endpoint.log_likelihood(scan, poses, float(floor))
        np.testing.assert_array_equal(found[values >= floor], values[values >= floor])
        below = found[values < floor]
        assert ((below == -np.inf) | (below == values[values < floor])).all()
    assert (endpoint.log_likelihood(scan, poses, float(values.max())) == -np.inf).sum() > 100


@pytest.mark.parametrize("name", ["beta", "sigma", "z_hit", "z_rand"])
def test_what_is_not_positive_is_refused(name: str) -> None:
    with pytest.raises(InputError, match=f"Endpoint.{name} must be"):
        Endpoint(**{name: 0.0})


@pytest.mark.parametrize("offset", [(0.0, 0.0), (0.0, 3.2), (-3.2, -6.4)])
def test_a_wall_on_the_border_of_tiles_reads_the_same_from_both_sides(offset) -> None:
    """Echoes of a wall at x = 0 exactly fall into one tile or the other: a former bug."""
    wall = np.array([[0.0, -1.0, 0.0, 1.0]]) + np.tile(offset, 2)
    angles = np.radians(np.arange(-40, 41, 2.0))
    found = []
    for side in (1, -1):
        grid, endpoint, rng = Static(), Endpoint(), np.random.default_rng(0)
        for k in range(20):
            heading = 0.0 if side < 0 else math.pi
            pose = Pose2(offset[0] + side * 0.93, offset[1] + 0.013, heading)
            seen = scan_at(pose, k, angles, wall)
            noise = rng.normal(0, 0.01, len(angles))[::-side]
            scan = Scan(seen.ranges + noise, angles, 6.0, time=k)
            endpoint.refresh(grid, grid.integrate(scan, pose))
        d = np.linspace(-0.08, 0.08, 17)
        points = np.column_stack([offset[0] + side * d, np.full(17, offset[1]), np.zeros(17)])
        found.append(endpoint.log_likelihood(beam(1.0), points - (1.0, 0, 0)))
    np.testing.assert_allclose(found[0], found[1], atol=0.03)
    assert abs(found[0].argmax() - 8) <= 1
    # free before it, unknown behind
    assert found[0].max() - found[0][-1] > 0.15


@pytest.mark.parametrize(("column", "known"), [(1.5, True), (1.01, True), (0.99, False)])
def test_the_outermost_cells_cannot_be_read_between(column: float, known: bool) -> None:
    grid, endpoint = mapped(Static(), Endpoint(beta=1.0), loop(3))
    tiles = grid.cells.tiles
    endpoint.field(0).values[:] = np.random.default_rng(0).normal(
        size=endpoint.field(0).values.shape
    )
    x, y = tiles.origin[0] + column * 0.05, tiles.origin[1] + 100.4 * 0.05
    pose = np.array([[x - 1.0, y, 0.0]])
    found = endpoint.log_likelihood(beam(1.0), pose)[0]
    read = naive.spline(tiles.dense(endpoint.field(0)), column, 100.4)
    assert found == pytest.approx(read if known else endpoint.unknown, abs=1e-5)


def test_two_thousand_beams_and_one() -> None:
    _, endpoint = mapped(Static(), Endpoint(), loop(8))
    pose = Pose2(0.1, 0.2, 0.3)
    many = scan_at(pose, angles=np.linspace(-3, 3, 2000))
    one = Scan(many.ranges[:1], many.angles[:1], 6.0)
    values = [endpoint.log_likelihood(s, np.array([pose]))[0] for s in (many, one)]
    assert values[0] / 2000 == pytest.approx(0.3 * math.log(0.8), abs=0.1)
    assert 0.3 * math.log(0.1) < values[1] < 0
    assert len(FAN) < 2000


def test_shares_are_those_of_echoes_near_something_and_where_it_is_free_or_behind_a_wall() -> None:
    grid, endpoint = mapped(Static(), Endpoint(), loop(8))
    tiles, scan = grid.cells.tiles, scan_at(Pose2(0.3, 0.1, 0.4), mount=Pose2(0.2, 0.05, 0.1))
    field = tiles.dense(endpoint.field(0))
    rows, cols = field.shape

    def value(point) -> float:
        row, col = naive.cell(point - tiles.origin, 0.05)
        inside = 0 <= row < rows and 0 <= col < cols
        return field[row, col] if inside else math.log(0.9 * 0.2 + 0.1)

    found = []
    occupied, empty = math.log(0.9 * 0.4 + 0.1), math.log(0.9 * 0.1 + 0.1)
    for pose in [(0.3, 0.1, 0.4), *np.random.default_rng(2).normal(size=(20, 3))]:
        near = free = behind = 0
        views = 0.15 * transform_points(Pose2(theta=pose[2]), scan.views)
        for point, view in zip(transform_points(Pose2.of(pose), scan.points), views, strict=True):
            near += value(point) > occupied
            free += value(point) < empty
            behind += value(point) > occupied and value(point - view) >= empty > value(point + view)
        n = len(scan.points)
        found.append(endpoint.shares(scan.points, Pose2.of(pose)))
        assert found[-1] == pytest.approx((near / n, free / n))
        beyond = endpoint.behind(scan.points, scan.views, Pose2.of(pose))
        assert beyond == pytest.approx(behind / n)
    assert found[0][0] > 0.95
    assert found[0][1] < 0.02
    assert max(free for _, free in found) > 0.3
    assert endpoint.behind(scan.points, -scan.views, Pose2(0.3, 0.1, 0.4)) > 0.9
    assert endpoint.shares(scan.points, Pose2(500.0)) == (0.0, 0.0)
    assert endpoint.behind(scan.points, scan.views, Pose2(500.0)) == 0.0
    nothing = beam(math.nan)
    assert endpoint.shares(nothing.points, Pose2()) == (0.0, 0.0)
    assert endpoint.behind(nothing.points, nothing.views, Pose2()) == 0.0
