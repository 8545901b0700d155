import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slam.geometry import Pose2
from slam.grid import GridSpec
from slam.maps.rays import Rays, covering, trace
from slam.scan import Scan
from tests.slam import naive
from tests.slam.worlds import beam

RESOLUTION = 0.05
lattice = st.integers(-400, 400).map(lambda n: n * 0.0101 + 0.0003)  # on no line of the lattice
points = st.tuples(lattice, lattice)


def traced(sensor, ends, hit) -> dict[tuple[int, int], bool]:
    sensor, ends = np.array(sensor), np.array(ends, dtype=float).reshape(-1, 2)
    spec = covering(GridSpec(RESOLUTION, 0, 0, 0, 0), sensor, ends)
    seen = trace(spec, sensor, ends, np.array(hit, dtype=bool))
    assert len(set(seen.cells.tolist())) == len(seen.cells)
    cells = np.column_stack(np.divmod(seen.cells, spec.cols)) + (spec.row0, spec.col0)
    return {(r, c): h for (r, c), h in zip(cells.tolist(), seen.hit.tolist(), strict=True)}


@given(points, st.lists(st.tuples(points, st.booleans()), min_size=1, max_size=6))
def test_cells_are_those_that_the_beams_cross(sensor, beams) -> None:
    expected: dict[tuple[int, int], bool] = {}
    for end, _ in beams:
        crossed = naive.crossed(sensor, end, RESOLUTION)
        expected |= dict.fromkeys(crossed, False)
    expected |= {naive.cell(end, RESOLUTION): True for end, hit in beams if hit}
    found = traced(sensor, [end for end, _ in beams], [hit for _, hit in beams])
    assert expected.items() <= found.items()
    for cut in found.keys() - expected.keys():  # a corner that a beam passes through
        assert any(naive.touched(sensor, end, cut, RESOLUTION) for end, _ in beams)
        assert not found[cut]


@pytest.mark.parametrize(("dx", "dy"), [(1, 0), (-1, 0), (0, 1), (0, -1)])
def test_straight_beams_by_hand(dx: int, dy: int) -> None:
    sensor = (0.025, 0.025)
    end = (0.025 + 0.1 * dx, 0.025 + 0.1 * dy)
    expected = {(0, 0): False, (dy, dx): False, (2 * dy, 2 * dx): True}
    assert traced(sensor, [end], [True]) == expected


def test_a_hit_outweighs_the_beam_that_passes_whatever_the_order() -> None:
    near, far = (0.125, 0.025), (0.225, 0.025)
    for ends, hits in (([near, far], [True, False]), ([far, near], [False, True])):
        found = traced((0.025, 0.025), ends, hits)
        assert found == {(0, 0): False, (0, 1): False, (0, 2): True, (0, 3): False, (0, 4): False}


def test_an_echo_in_the_sensors_own_cell_and_no_beam_at_all() -> None:
    assert traced((0.01, 0.01), [(0.02, 0.02)], [True]) == {(0, 0): True}
    assert traced((0.01, 0.01), [], []) == {}


@pytest.mark.parametrize("seed", range(5))
def test_ends_of_every_kind_of_reading(seed: int) -> None:
    rng = np.random.default_rng(seed)
    ranges = rng.uniform(0.0, 7.0, 40)
    ranges[::5] = rng.choice([math.nan, math.inf, -1.0, 0.0], 8)
    scan = Scan(ranges, rng.uniform(-3, 3, 40), 6.0, 0.5, mount=Pose2(*rng.normal(size=3)))
    pose = Pose2(*rng.normal(size=3))
    sensor, ends, hit = Rays(reach=4.0, no_echo_reach=3.0).ends(scan, pose)
    naive_sensor, beams = naive.beams(scan, pose, 4.0, 3.0)
    np.testing.assert_allclose(sensor, naive_sensor)
    np.testing.assert_allclose(ends, [end for end, _ in beams])
    assert hit.tolist() == [h for _, h in beams]


@pytest.mark.parametrize(
    ("length", "max_range", "way", "hit"),
    [
        (2.0, 10.0, 2.0, True),
        (3.0, 10.0, 3.0, True),
        (3.1, 10.0, 3.0, False),  # too far to be believed, but the way is clear
        (math.inf, 10.0, 1.0, False),
        (math.inf, 0.5, 0.5, False),
    ],
)
def test_reach_by_hand(length: float, max_range: float, way: float, hit: bool) -> None:
    rays = Rays(reach=3.0, no_echo_reach=1.0)
    _, ends, hits = rays.ends(beam(length, max_range=max_range), Pose2(1.0, 1.0, math.pi / 2))
    np.testing.assert_allclose(ends, [[1.0, 1.0 + way]])
    assert hits.tolist() == [hit]


def test_the_scan_is_left_as_it_was() -> None:
    scan = beam(5.0)
    Rays(reach=3.0).ends(scan, Pose2())
    assert scan.hit.tolist() == [True]


def test_a_point_that_rounding_puts_across_the_border_stays_in_the_grid() -> None:
    sensor, ends = np.array([0.5, -1e-17]), np.array([[0.7, -0.1]])
    spec = covering(GridSpec(RESOLUTION, 0, 0, 0, 0), sensor, ends)
    seen = trace(spec, sensor, ends, np.array([True]))
    assert seen.cells.max() < spec.rows * spec.cols


def test_a_map_far_from_the_origin_is_not_larger() -> None:
    sensor, ends = np.array([100.2, -200.2]), np.array([[100.4, -200.4]])
    spec = covering(GridSpec(RESOLUTION, 0, 0, 0, 0), sensor, ends)
    assert spec.rows * spec.cols <= 4 * 64 * 64
