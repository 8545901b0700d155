"""The field of `Endpoint`, updated incrementally, against the field computed at once."""

import math

import numpy as np
import pytest

from slam.errors import InputError
from slam.geometry import Pose2
from slam.maps.histogram import Histogram
from slam.maps.static import Static
from slam.maps.tiles import TILE
from slam.sensor_models.endpoint import Endpoint
from slam.sensor_models.field import H_MAX, H_MIN, MIN_CENTROID_CHANGE, MIN_H_CHANGE, NO_CENTROID
from slam.sensor_models.pyramid import MAX_UNITS
from tests.slam import naive
from tests.slam.sensor_models.rooms import dense, mapped, observed
from tests.slam.worlds import FAN, ROOM, beam, scan_at

TABLE = 1.5e-3  # half a step of the logarithm's table, log(50) / 4095 / 2, and float32


def rebuilt(grid, endpoint: Endpoint) -> np.ndarray:
    """The field computed from the endpoint's h (in 1/255) and centroids (in 1/256 of a cell)."""
    tiles, resolution = grid.cells.tiles, grid.cells.tiles.resolution
    moved = tiles.dense(endpoint._centroid)
    known = np.dstack([tiles.dense(endpoint._h_level) / 255, moved / 256 * resolution])
    return naive.field(known, moved[..., 0] != NO_CENTROID, resolution, endpoint.sigma,
                       endpoint.z_hit, endpoint.z_rand)  # fmt: skip


def assert_up_to_date(grid, endpoint: Endpoint) -> None:
    tiles = grid.cells.tiles
    field = tiles.dense(endpoint.field(0))
    np.testing.assert_allclose(field, rebuilt(grid, endpoint), atol=TABLE)
    assert not endpoint._stale.values.any()
    for level in (1, 2):
        side = TILE >> level
        mean = field.reshape(len(field) >> level, 1 << level, -1, 1 << level).mean(axis=(1, 3))
        np.testing.assert_allclose(dense(tiles, endpoint.field(level), side), mean, atol=1e-5)
    most = field.reshape(len(field) >> 1, 2, -1, 2).max(axis=(1, 3))
    units = (most - endpoint.nothing) * (MAX_UNITS / (endpoint.top - endpoint.nothing))
    maxima = dense(tiles, endpoint.maxima, TILE >> 1).astype(np.float64)
    np.testing.assert_array_less(np.abs(maxima - 0.5 - units), 0.51)


def assert_noted(grid, endpoint: Endpoint) -> None:
    """The endpoint's h and centroids are the map's, up to the changes that are ignored."""
    tiles, cells = grid.cells.tiles, grid.cells
    echoes = tiles.dense(cells.centroids.count) > 0
    h = np.clip(tiles.dense(cells.occupied) * 255, H_MIN, H_MAX)
    level, moved = tiles.dense(endpoint._h_level).astype(float), tiles.dense(endpoint._centroid)
    np.testing.assert_array_equal(moved[..., 0] != NO_CENTROID, echoes)
    offset = tiles.dense(cells.centroids.offset) / 256
    assert np.abs(moved - offset)[echoes].max() <= MIN_CENTROID_CHANGE + 1
    assert np.abs(level - h)[echoes].max() <= MIN_H_CHANGE
    bare = tiles.dense(cells.observed) & ~echoes
    prior = round(255 * cells.prior)
    free = tiles.dense(cells.occupied) < cells.prior - 0.01
    assert (level[bare & free] == H_MIN).all()
    assert set(np.unique(level[bare & ~free])) <= {float(prior), float(H_MIN)}


@pytest.mark.parametrize("model", [Static, Histogram])
@pytest.mark.parametrize("sigma", [0.04, 0.08])
def test_the_field_kept_up_to_date_is_the_field_rebuilt(model, sigma: float) -> None:
    grid, endpoint = mapped(model(), Endpoint(sigma=sigma), noise=0.01)
    assert_up_to_date(grid, endpoint)
    assert_noted(grid, endpoint)


def test_after_many_scans_the_field_is_that_of_the_final_map() -> None:
    grid, endpoint = mapped(Static(), Endpoint(), noise=0.01)
    fresh = Endpoint()
    fresh.refresh(grid, observed(grid))
    assert_up_to_date(grid, fresh)
    tiles = grid.cells.tiles
    apart = np.abs(tiles.dense(endpoint.field(0)) - tiles.dense(fresh.field(0)))
    assert apart.max() < 0.15  # both ignored changes, at the steepest
    assert apart.mean() < 0.005
    poses = np.array([[0.1, 0.2, 0.3], [0.4, -0.1, 2.0]])
    scan = scan_at(Pose2(0.1, 0.2, 0.3))
    known = fresh.log_likelihood(scan, poses)
    np.testing.assert_allclose(endpoint.log_likelihood(scan, poses), known, atol=0.5)


@pytest.mark.parametrize("shift", [(0.0, 0.0), (-7.3, 11.1), (3.2, -3.2)])
def test_it_follows_a_map_that_grows_every_way(shift: tuple[float, float]) -> None:
    grid, endpoint = Static(), Endpoint()
    for x, y, theta in [(0, 0, 0), (3, 0, 1), (0, 3, 2), (-3, 0, 3), (0, -3, 4), (0, 0, 5)]:
        scan = scan_at(Pose2(0.1, 0.1))
        pose = Pose2(x + shift[0], y + shift[1], theta)
        endpoint.refresh(grid, grid.integrate(scan, pose))
        assert_up_to_date(grid, endpoint)
    assert_noted(grid, endpoint)


@pytest.mark.parametrize("x", [3.15, 3.199, 3.2, 3.201, 3.25, 0.05, 0.001, -0.001, -3.2])
@pytest.mark.parametrize("y", [0.52, 3.19, -0.01])
def test_echoes_about_a_tiles_border_reach_over_it(x: float, y: float) -> None:
    grid, endpoint = Static(), Endpoint(sigma=0.07)
    for k in range(4):
        endpoint.refresh(grid, grid.integrate(beam(0.5, k), Pose2(x - 0.5, y)))
        assert_up_to_date(grid, endpoint)
    field = grid.cells.tiles.dense(endpoint.field(0))
    assert (field > endpoint.unknown + 0.1).sum() > 8


def test_an_echo_far_out_is_looked_around_within_what_the_map_spans() -> None:
    """A block at the border of all tiles: it was read beyond the end of the array once."""
    for k in range(64):
        grid, endpoint = Static(), Endpoint(sigma=0.05)
        endpoint.refresh(grid, grid.integrate(beam(1.0), Pose2(0.05 * k, 0.05 * k, math.pi / 2)))
        endpoint.refresh(grid, grid.integrate(beam(1.0), Pose2(0.05 * k, -0.05 * k, math.pi)))
        reach = 2 * endpoint._radius + 8
        spec, (rows, cols) = grid.cells.tiles.spec, np.nonzero(
            grid.cells.tiles.dense(grid.cells.centroids.count)
        )  # fmt: skip
        assert min(rows.min(), cols.min()) >= reach
        assert rows.max() + reach < spec.rows
        assert cols.max() + reach < spec.cols
        assert_up_to_date(grid, endpoint)


@pytest.mark.parametrize("kept_before", [True, False])
def test_coarser_fields_of_maps_that_share_tiles_are_up_to_date(kept_before: bool) -> None:
    grid, endpoint = mapped(Static(), Endpoint())
    tiles = grid.cells.tiles
    maps = [tiles.current, tiles.fork(), tiles.fork()]
    if kept_before:  # else coarser fields are kept from the first check on
        assert_up_to_date(grid, endpoint)
    for again in range(2):
        for k, one in enumerate(maps):
            tiles.switch(one)
            for time in range(8):  # an echo where all was free
                scan = beam(0.5 + 0.2 * k, time)
                endpoint.refresh(grid, grid.integrate(scan, Pose2(0.1 * k, 0.3 * again)))
        for one in maps:
            tiles.switch(one)
            assert_up_to_date(grid, endpoint)


def test_unknown_space_counts_as_the_prior_and_seen_space_as_free() -> None:
    grid, endpoint = mapped(Static(), Endpoint())
    tiles = grid.cells.tiles
    field, seen = tiles.dense(endpoint.field(0)), tiles.dense(grid.cells.observed)
    assert endpoint.unknown == pytest.approx(math.log(0.9 * 0.2 + 0.1))
    assert field[~seen].min() >= endpoint.unknown - TABLE
    assert field[0, 0] == np.float32(endpoint.unknown)
    row, col = tiles.spec.cells(np.array([[0.0, 0.0]]))[0]
    assert field[row, col] == pytest.approx(math.log(0.9 * H_MIN / 255 + 0.1), abs=TABLE)


@pytest.mark.parametrize(("sigma", "resolution"), [(0.101, 0.05), (1.0, 0.05), (0.2, 0.09)])
def test_a_sigma_too_large_for_the_cells_is_refused(sigma: float, resolution: float) -> None:
    grid = Static(resolution)
    changed = grid.integrate(beam(1.0), Pose2())
    most = f"Endpoint.sigma may be {2 * resolution:g} m at most with cells of {resolution:g} m"
    with pytest.raises(InputError, match=most):
        Endpoint(sigma=sigma).refresh(grid, changed)


def test_the_largest_sigma_works() -> None:
    grid, endpoint = mapped(Static(), Endpoint(sigma=0.1))
    assert_up_to_date(grid, endpoint)


def test_cells_of_a_metre_are_as_good_as_others() -> None:
    grid, endpoint = Static(1.0), Endpoint(sigma=1.0)
    endpoint.refresh(grid, grid.integrate(beam(3.0), Pose2(0.5, 0.5)))
    assert_up_to_date(grid, endpoint)


def test_another_map_begins_anew() -> None:
    _, endpoint = mapped(Static(), Endpoint())
    shifted = ROOM + np.tile((0.1, 0.07), 2)
    other = Histogram()
    scan = scan_at(Pose2(), walls=shifted)
    endpoint.refresh(other, other.integrate(scan, Pose2()))
    assert_up_to_date(other, endpoint)
    alone = Endpoint()
    alone.refresh(other, observed(other))
    poses = np.zeros((1, 3))
    scan = scan_at(Pose2(), angles=FAN)
    assert endpoint.log_likelihood(scan, poses) == alone.log_likelihood(scan, poses)


def test_a_field_without_a_span_has_no_units() -> None:
    """What an echo is worth where the map explains as much as nothing: 1 is lost beside 1e20."""
    _, endpoint = mapped(Static(), Endpoint(z_hit=0.9, z_rand=1e20))
    assert endpoint.top == endpoint.nothing
    assert endpoint.field(1).values.size
    assert not endpoint.maxima.values.any()
