import math

import numpy as np
import pytest

from slam.errors import InputError
from slam.geometry import Pose2, compose
from slam.maps.histogram import Histogram
from slam.maps.rays import Rays
from slam.maps.static import Static
from slam.scan import Scan
from slam.sensor_models.literal import Literal
from tests.slam import naive
from tests.slam.sensor_models.rooms import around, mapped
from tests.slam.sensor_models.test_beam import MOUNT, some_scan
from tests.slam.worlds import beam, loop, scan_at


@pytest.mark.parametrize("model", [Static, Histogram])
@pytest.mark.parametrize("seed", range(5))
def test_it_is_the_probability_of_the_map_that_the_scan_implies(model, seed: int) -> None:
    rng = np.random.default_rng(seed)
    rays = Rays(reach=1.2, no_echo_reach=0.7) if seed % 2 else Rays()
    grid, reading = mapped(model(rays=rays), Literal(beta=0.3), loop(7), noise=0.01)
    scan = some_scan(seed, n=30, mount=MOUNT if seed > 1 else Pose2())
    poses = np.column_stack([rng.uniform(-2, 3, (8, 2)), rng.uniform(-3, 3, 8)])
    expected = [naive.literal_reading(reading, grid, scan, Pose2.of(pose)) for pose in poses]
    np.testing.assert_allclose(reading.log_likelihood(scan, poses), expected, rtol=1e-5)


def test_one_beam_by_hand() -> None:
    grid, reading = Static(1.0), Literal(beta=0.5)
    pose = Pose2(0.5, 0.5)
    for k in range(30):
        reading.refresh(grid, grid.integrate(beam(3.0, k), pose))
    read = lambda scan: reading.log_likelihood(scan, np.array([pose]))[0]  # noqa: E731
    assert read(beam(3.0)) == pytest.approx(0.5 * 4 * math.log(0.98))
    assert read(beam(2.0)) == pytest.approx(0.5 * (2 * math.log(0.98) + math.log(0.02)))
    passing = 3 * math.log(0.98) + math.log(0.02) + math.log(0.2)
    assert read(beam(4.0)) == pytest.approx(0.5 * passing)
    no_echo = Scan(np.array([np.inf]), np.zeros(1), 4.0)
    assert read(no_echo) == pytest.approx(0.5 * (passing - math.log(0.2) + math.log(0.8)))


def test_a_cell_counts_once_and_a_hit_outweighs_the_beams_that_pass() -> None:
    _, reading = mapped(Static(), Literal(), loop(8))
    scan, pose = scan_at(Pose2(0.1, 0.2, 0.3)), np.array([[0.1, 0.2, 0.3]])
    twice = Scan(np.tile(scan.ranges, 2), np.tile(scan.angles, 2), 6.0)
    once = reading.log_likelihood(scan, pose)[0]
    assert reading.log_likelihood(twice, pose)[0] == pytest.approx(once)


@pytest.mark.parametrize("model", [Static, Histogram])
def test_the_likelihood_peaks_near_the_truth(model) -> None:
    _, reading = mapped(model(), Literal())
    truth = Pose2(0.217, -0.144, 2.2)
    errors = around(truth)
    scores = reading.log_likelihood(scan_at(truth), compose(truth, errors))
    best = errors[scores.argmax()]
    assert math.hypot(best[0], best[1]) <= 0.03  # to the cell
    assert abs(best[2]) <= np.radians(1.5)


def test_whatever_is_no_reading_says_nothing() -> None:
    _, reading = mapped(Static(), Literal(), loop(3))
    scan, poses = scan_at(Pose2(0.1, 0.1)), np.array([[0.1, 0.1, 0.0]])
    ranges = np.concatenate([scan.ranges, [np.nan, 0.0, -1.0]])
    more = Scan(ranges, np.concatenate([scan.angles, np.zeros(3)]), 6.0)
    assert reading.log_likelihood(more, poses) == reading.log_likelihood(scan, poses)
    for nothing in (np.zeros(0), np.full(5, np.nan)):
        empty = Scan(nothing, np.zeros(len(nothing)), 6.0)
        assert reading.log_likelihood(empty, poses) == 0.0
        assert not reading.slope(empty, Pose2()).gradient.any()


def test_outside_of_the_map_all_is_unknown() -> None:
    _, reading = mapped(Static(), Literal(beta=1.0), loop(3))
    found = reading.log_likelihood(beam(1.0), np.array([[500.01, -300.01, 0.0]]))[0]
    assert found == pytest.approx(20 * math.log(0.8) + math.log(0.2))


def test_two_thousand_beams() -> None:
    grid, reading = mapped(Static(), Literal(), loop(8))
    pose = Pose2(0.1, 0.2, 0.3)
    many = scan_at(pose, angles=np.linspace(-3, 3, 2000))
    expected = naive.literal_reading(reading, grid, many, pose)
    assert reading.log_likelihood(many, np.array([pose]))[0] == pytest.approx(expected, rel=1e-3)


def test_above_the_floor_nothing_changes_and_below_it_nothing_is_missed() -> None:
    _, reading = mapped(Static(), Literal(), loop(8))
    scan = scan_at(Pose2(0.1, 0.2, 0.3))
    poses = (0.1, 0.2, 0.3) + np.random.default_rng(1).normal(0, (0.1, 0.1, 0.1), (100, 3))
    values = reading.log_likelihood(scan, poses)
    for floor in (values.max(), np.median(values), values.min()):
        found = reading.log_likelihood(scan, poses, float(floor))
        np.testing.assert_array_equal(found[values >= floor], values[values >= floor])
        below = found[values < floor]
        assert ((below == -np.inf) | (below == values[values < floor])).all()
    assert (reading.log_likelihood(scan, poses, float(values.max())) == -np.inf).sum() > 20


def test_another_map_is_read_as_it_is() -> None:
    _, reading = mapped(Static(), Literal(), loop(8))
    other = Histogram()
    reading.refresh(other, other.integrate(scan_at(Pose2()), Pose2()))
    scan, pose = scan_at(Pose2(0.1, 0.1)), Pose2(0.1, 0.1)
    expected = naive.literal_reading(reading, other, scan, pose)
    assert reading.log_likelihood(scan, np.array([pose]))[0] == pytest.approx(expected, rel=1e-4)


def test_what_is_not_positive_is_refused() -> None:
    with pytest.raises(InputError, match=r"Literal.beta must be"):
        Literal(beta=0)
