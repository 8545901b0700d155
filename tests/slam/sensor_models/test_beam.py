import math

import numpy as np
import pytest

from slam.errors import InputError
from slam.geometry import Pose2, compose
from slam.maps.histogram import Histogram
from slam.maps.log_odds import Evidence
from slam.maps.rays import Rays
from slam.maps.static import Static
from slam.scan import Scan
from slam.sensor_models.beam import Beam
from tests.slam import naive
from tests.slam.sensor_models.rooms import CORNER, around, mapped, observed
from tests.slam.worlds import FAN, beam, loop, scan_at

MOUNT = Pose2(0.15, -0.05, 0.3)


def some_scan(seed: int, n: int = 12, max_range: float = 2.0, mount=Pose2()) -> Scan:
    """Random ranges, some beams without echo, some without reading."""
    rng = np.random.default_rng(seed)
    ranges = rng.uniform(0.05, 1.6, n)
    ranges[rng.random(n) < 0.2] = np.inf
    ranges[rng.random(n) < 0.1] = np.nan
    return Scan(ranges, rng.uniform(-np.pi, np.pi, n), max_range, mount=mount)


@pytest.mark.parametrize("model", [Static, Histogram])
@pytest.mark.parametrize("seed", range(4))
def test_it_is_the_first_hit_beam_by_beam_and_cell_by_cell(model, seed: int) -> None:
    rng = np.random.default_rng(seed)
    poses = np.column_stack([rng.uniform(-0.5, 0.7, (6, 2)), rng.uniform(-3, 3, 6)])
    grid, reading = mapped(
        model(), Beam(beta=0.3), poses, walls=CORNER + rng.normal(0, 0.1, 4), noise=0.01
    )
    scan = some_scan(seed, mount=MOUNT if seed % 2 else Pose2())
    asked = np.column_stack([rng.uniform(-0.6, 0.8, (4, 2)), rng.uniform(-3, 3, 4)])
    expected = [naive.beam_reading(reading, grid, scan, Pose2.of(pose)) for pose in asked]
    np.testing.assert_allclose(reading.log_likelihood(scan, asked), expected, rtol=2e-3, atol=5e-3)


def test_true_scans_too() -> None:
    grid, reading = mapped(Static(), Beam(), loop(20)[::4], walls=CORNER)
    pose = Pose2(0.1, 0.05, 0.8)
    scan = scan_at(pose, angles=FAN[::6], walls=CORNER)
    asked = np.array(pose) + np.random.default_rng(0).normal(0, 0.02, (4, 3))
    expected = [naive.beam_reading(reading, grid, scan, Pose2.of(pose)) for pose in asked]
    np.testing.assert_allclose(reading.log_likelihood(scan, asked), expected, rtol=2e-3, atol=5e-3)


@pytest.mark.parametrize("model", [Static, Histogram])
def test_kept_up_to_date_it_is_as_read_at_once(model) -> None:
    grid, reading = mapped(model(), Beam(), noise=0.01)
    fresh = Beam()
    fresh.refresh(grid, observed(grid))
    for name in ("_passing", "_even"):
        np.testing.assert_array_equal(getattr(reading, name).values, getattr(fresh, name).values)
    solid = reading._passing.flat > 0
    assert solid.sum() > 100
    np.testing.assert_array_equal(reading._wall.flat[solid], fresh._wall.flat[solid])


def test_a_block_is_even_where_all_its_cells_are_alike() -> None:
    grid, reading = mapped(Static(), Beam())
    tiles = grid.cells.tiles
    passing = tiles.dense(reading._passing)
    rows, cols = passing.shape
    blocks = passing.reshape(rows // 8, 8, cols // 8, 8).swapaxes(1, 2).reshape(-1, 64)
    alike = (blocks == blocks[:, :1]).all(axis=1) & (blocks[:, 0] <= 0)
    even = reading._even.values.reshape(-1, 8, 8)[tiles.index].swapaxes(1, 2).reshape(-1)
    np.testing.assert_array_equal(even, np.where(alike, blocks[:, 0], np.float32(1.0)))
    assert 10 < alike.sum() < len(alike) - 10


@pytest.mark.parametrize("model", [Static, Histogram])
@pytest.mark.parametrize("mount", [Pose2(), MOUNT])
def test_the_likelihood_peaks_at_the_truth(model, mount: Pose2) -> None:
    _, reading = mapped(model(), Beam(), noise=0.005)
    truth = Pose2(0.217, -0.144, 2.2)
    errors = around(truth, n=4)
    scan = scan_at(truth, mount=mount)
    scores = reading.log_likelihood(scan, compose(truth, errors))
    best = errors[scores.argmax()]
    assert np.abs(best[:2]).max() <= 0.0125
    assert abs(best[2]) <= np.radians(0.5)
    assert scores.max() - scores.min() > 10


def test_it_does_not_stick_to_the_cells() -> None:
    """The peak follows a robot that moves by less than a cell."""
    _, reading = mapped(Static(), Beam(), loop(40), noise=0.005)
    steps = np.arange(-10, 11) * 0.003
    for x in np.arange(0.2, 0.25, 0.0125):
        truth = np.array([x, 0.1, 0.0])
        scan = scan_at(Pose2.of(truth))
        for axis in (0, 1):
            poses = np.tile(truth, (len(steps), 1))
            poses[:, axis] += steps
            best = steps[reading.log_likelihood(scan, poses).argmax()]
            assert abs(best) <= 0.0065


def door(states, hit=1.5) -> tuple[Histogram, Beam]:
    """A door 1.2 m ahead, closed or open to a wall 2.2 m ahead, by `states`."""
    grid, reading = Histogram(delta_t=1.0, evidence=Evidence(hit=hit)), Beam(beta=1.0)
    for k, shut in enumerate(states):
        for j in range(4):
            scan = beam(1.225 if shut else 2.225, k + 0.2 * j)
            reading.refresh(grid, grid.integrate(scan, Pose2(0.5, 0.525)))
    return grid, reading


def test_a_door_half_open_costs_little_in_either_state() -> None:
    _, reading = door([True, False] * 6)
    pose = np.array([[0.5, 0.525, 0.0]])
    shut, ajar, beyond = (
        reading.log_likelihood(beam(z), pose)[0] for z in (1.225, 1.7, 2.225)
    )  # fmt: skip
    _, never = door([False] * 12)
    sure = never.log_likelihood(beam(2.225), pose)[0]
    free = 20 * math.log(0.98)  # from the door to the wall
    assert sure - shut == pytest.approx(math.log(2) + free, abs=0.05)
    assert sure - beyond == pytest.approx(math.log(2), abs=0.05)
    assert sure - ajar > 3
    assert sure - never.log_likelihood(beam(1.225), pose)[0] > 3


def test_a_beam_without_echo_by_hand() -> None:
    reading, grid = Beam(beta=1.0), Static(rays=Rays(no_echo_reach=3.0))
    pose = np.array([[0.5, 0.525, 0.0]])
    for k in range(40):
        reading.refresh(grid, grid.integrate(beam(np.inf, k), Pose2.of(pose[0])))
    # 3 m of cells that are as free as they get, then again with a wall in between
    free = 0.98 ** (3.0 / 0.05)
    found = reading.log_likelihood(beam(np.inf), pose)[0]
    assert found == pytest.approx(math.log(0.95 * free + 0.05), abs=0.01)
    for k in range(60):
        reading.refresh(grid, grid.integrate(beam(1.025, k), Pose2.of(pose[0])))
    found = reading.log_likelihood(beam(np.inf), pose)[0]
    assert found == pytest.approx(math.log(0.95 * free * 0.02 + 0.05), abs=0.02)


def test_unknown_space_is_as_dense_as_the_maps_prior() -> None:
    grid, reading = Static(evidence=Evidence(prior=0.3)), Beam(beta=1.0)
    reading.refresh(grid, grid.integrate(beam(0.5), Pose2(-20.0, 0.0)))
    rate, sigma = -math.log(1 - 0.3) / 0.05, reading.sigma
    for pose in ([50.0, 3.0, 0.1], [-19.0, 0.9, 1.0], [-1e5, -1e5, 2.0]):
        for z in (0.1, 0.4, 1.0):
            density = 0.95 * rate * math.exp(-rate * z + (rate * sigma) ** 2 / 2)
            found = reading.log_likelihood(beam(z), np.array([pose]))[0]
            inside = 0.5 * math.erfc(-(z - rate * sigma**2) / sigma / 2**0.5)  # it began at 0
            expected = math.log(density * inside + 0.05 / 10)
            assert found == pytest.approx(expected, abs=1e-3)


def test_whatever_is_no_reading_says_nothing() -> None:
    _, reading = mapped(Static(), Beam(), loop(3))
    scan, poses = scan_at(Pose2(0.1, 0.1)), np.array([[0.1, 0.1, 0.0]])
    ranges = np.concatenate([scan.ranges, [np.nan, 0.0, -1.0]])
    more = Scan(ranges, np.concatenate([scan.angles, np.zeros(3)]), 6.0)
    same = reading.log_likelihood(scan, poses)[0]
    assert reading.log_likelihood(more, poses)[0] == pytest.approx(same)
    for nothing in (np.zeros(0), np.full(5, np.nan)):
        empty = Scan(nothing, np.zeros(len(nothing)), 6.0)
        assert reading.log_likelihood(empty, poses) == 0.0
        assert not reading.slope(empty, Pose2()).gradient.any()
    assert reading.log_likelihood(scan, np.zeros((0, 3))).shape == (0,)


def test_beams_count_alike_one_or_two_thousand() -> None:
    _, reading = mapped(Static(), Beam(), loop(8))
    pose = np.array([[0.1, 0.2, 0.3]])
    many = scan_at(Pose2.of(pose[0]), angles=np.linspace(-3, 3, 2000))
    alone = [
        reading.log_likelihood(Scan(many.ranges[k : k + 1], many.angles[k : k + 1], 6.0), pose)[0]
        for k in range(2000)
    ]
    assert reading.log_likelihood(many, pose)[0] == pytest.approx(sum(alone))


def test_a_stride_looks_at_every_so_many_th_beam() -> None:
    grid, every = mapped(Static(), Beam(), loop(8))
    third = Beam(stride=3)
    third.refresh(grid, observed(grid))
    scan, pose = scan_at(Pose2(0.1, 0.2, 0.3)), np.array([[0.1, 0.2, 0.3]])
    some = Scan(scan.ranges[::3], scan.angles[::3], 6.0)
    found = third.log_likelihood(scan, pose)[0]
    assert found == pytest.approx(every.log_likelihood(some, pose)[0])


def test_above_the_floor_nothing_changes_and_below_it_nothing_is_missed() -> None:
    _, reading = mapped(Static(), Beam(), loop(8))
    scan = scan_at(Pose2(0.1, 0.2, 0.3))
    scan = Scan(scan.ranges, scan.angles, 2.0)  # some beams without echo
    assert 20 < scan.no_echo.sum() < 90
    poses = (0.1, 0.2, 0.3) + np.random.default_rng(1).normal(0, (0.1, 0.1, 0.1), (100, 3))
    values = reading.log_likelihood(scan, poses)
    for floor in (values.max(), np.median(values), values.min()):
        found = reading.log_likelihood(scan, poses, float(floor))
        np.testing.assert_array_equal(found[values >= floor], values[values >= floor])
        below = found[values < floor]
        assert ((below == -np.inf) | (below == values[values < floor])).all()
    assert (reading.log_likelihood(scan, poses, float(values.max())) == -np.inf).sum() > 50


def test_walls_on_the_border_of_tiles_read_the_same_from_both_sides() -> None:
    angles = np.radians(np.arange(-40, 41, 2.0))
    found = []
    for side in (1, -1):
        grid, reading, rng = Static(), Beam(), np.random.default_rng(0)
        for k in range(20):
            pose = Pose2(side * 0.93, 0.013, 0.0 if side < 0 else math.pi)
            seen = scan_at(pose, k, angles, np.array([[0.0, -1.0, 0.0, 1.0]]))
            noise = rng.normal(0, 0.01, len(angles))[::-side]
            scan = Scan(seen.ranges + noise, angles, 6.0, time=k)
            reading.refresh(grid, grid.integrate(scan, pose))
        shifts = np.linspace(-0.06, 0.06, 13)
        poses = np.column_stack([side * (0.93 + shifts), np.full(13, 0.013),
                                 np.full(13, 0.0 if side < 0 else math.pi)])  # fmt: skip
        truth = scan_at(Pose2.of(poses[6]), 0, angles, np.array([[0.0, -1.0, 0.0, 1.0]]))
        found.append(reading.log_likelihood(truth, poses))
    assert abs(found[0].argmax() - 6) <= 1
    assert abs(found[1].argmax() - 6) <= 1
    np.testing.assert_allclose(found[0], found[1], atol=2.0)


def test_another_map_begins_anew() -> None:
    _, reading = mapped(Static(), Beam(), loop(8))
    other = Histogram(evidence=Evidence(prior=0.3))
    reading.refresh(other, other.integrate(scan_at(Pose2()), Pose2()))
    alone = Beam()
    alone.refresh(other, observed(other))
    scan, poses = scan_at(Pose2(0.1, 0.1)), np.array([[0.0, 0.0, 0.0], [9.0, 0.0, 0.0]])
    np.testing.assert_array_equal(
        reading.log_likelihood(scan, poses), alone.log_likelihood(scan, poses)
    )


@pytest.mark.parametrize("name", ["beta", "sigma", "spread", "z_hit", "z_rand", "stride"])
def test_what_is_not_positive_is_refused(name: str) -> None:
    with pytest.raises(InputError, match=f"Beam.{name} must be"):
        Beam(**{name: 0})
