import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slam.geometry import Pose2
from slam.maps.rays import TILE_MARGIN, ObservedCells, Rays, Tracer
from slam.maps.tiles import AREA, TILE, Tiles
from slam.scan import Scan
from tests.slam import naive
from tests.slam.maps.driving import id_of, lattice
from tests.slam.worlds import beam

RESOLUTION = 0.05
numbers = st.integers(-400, 400).map(lambda n: n * 0.0101 + 0.0003)  # on no line of the lattice
points = st.tuples(numbers, numbers)
beams_to = st.lists(st.tuples(points, st.booleans()), min_size=1, max_size=6)


def trace(tiles: Tiles, sensor, ends, hit, tracer: Tracer | None = None) -> ObservedCells:
    ends = np.array(ends, dtype=float).reshape(-1, 2)
    return (tracer or Tracer()).trace(tiles, np.array(sensor), ends, np.array(hit, dtype=bool))


def found(tiles: Tiles, seen: ObservedCells) -> dict[tuple[int, int], bool]:
    assert len(set(seen.cells.tolist())) == len(seen.cells)
    assert (seen.cells >= AREA).all()  # none in the blank tile
    return dict(zip(lattice(tiles, seen.cells), seen.hit.tolist(), strict=True))


def traced(sensor, ends, hit) -> dict[tuple[int, int], bool]:
    tiles = Tiles(RESOLUTION)
    return found(tiles, trace(tiles, sensor, ends, hit))


@given(points, beams_to)
def test_cells_are_those_that_the_beams_cross(sensor, beams) -> None:
    expected: dict[tuple[int, int], bool] = {}
    for end, _ in beams:
        crossed = naive.crossed(sensor, end, RESOLUTION)
        expected |= dict.fromkeys(crossed, False)
    expected |= {naive.cell(end, RESOLUTION): True for end, hit in beams if hit}
    cells = traced(sensor, [end for end, _ in beams], [hit for _, hit in beams])
    assert expected.items() <= cells.items()
    for cut in cells.keys() - expected.keys():  # a corner that a beam passes through
        assert any(naive.touched(sensor, end, cut, RESOLUTION) for end, _ in beams)
        assert not cells[cut]


@given(st.lists(st.tuples(points, beams_to), min_size=2, max_size=4))
def test_a_scan_leaves_nothing_behind_for_the_next(scans) -> None:
    tiles, tracer = Tiles(RESOLUTION), Tracer()
    for sensor, beams in scans:
        ends, hit = [end for end, _ in beams], [hit for _, hit in beams]
        seen = trace(tiles, sensor, ends, hit, tracer)
        alone = traced(sensor, ends, hit)
        for cut, struck in found(tiles, seen).items() ^ alone.items():  # a corner, rounded
            assert any(naive.touched(sensor, end, cut, RESOLUTION) for end in ends)
            assert not struck
        assert seen.echoes.tolist() == [list(end) for end, hit in beams if hit]


@given(points, beams_to)
def test_tiles_are_taken_for_all_that_was_seen_and_around_the_echoes(sensor, beams) -> None:
    tiles = Tiles(RESOLUTION)
    seen = trace(tiles, sensor, [end for end, _ in beams], [hit for _, hit in beams])
    needed = {(row // TILE, col // TILE) for row, col in lattice(tiles, seen.cells)}
    for (row, col), hit in found(tiles, seen).items():
        if hit:
            corners = itertools.product((-TILE_MARGIN, TILE_MARGIN), repeat=2)
            needed |= {((row + r) // TILE, (col + c) // TILE) for r, c in corners}
    assert {tuple(place) for place in tiles.places[1:].tolist()} == needed


@pytest.mark.parametrize(("dx", "dy"), [(1, 0), (-1, 0), (0, 1), (0, -1)])
def test_straight_beams_by_hand(dx: int, dy: int) -> None:
    sensor = (0.025, 0.025)
    end = (0.025 + 0.1 * dx, 0.025 + 0.1 * dy)
    expected = {(0, 0): False, (dy, dx): False, (2 * dy, 2 * dx): True}
    assert traced(sensor, [end], [True]) == expected


def test_a_hit_outweighs_the_beam_that_passes_whatever_the_order() -> None:
    near, far = (0.125, 0.025), (0.225, 0.025)
    for ends, hits in (([near, far], [True, False]), ([far, near], [False, True])):
        cells = traced((0.025, 0.025), ends, hits)
        assert cells == {(0, 0): False, (0, 1): False, (0, 2): True, (0, 3): False, (0, 4): False}


def test_an_echo_in_the_sensors_own_cell_and_no_beam_at_all() -> None:
    assert traced((0.01, 0.01), [(0.02, 0.02)], [True]) == {(0, 0): True}
    assert traced((0.01, 0.01), [], []) == {}


def test_a_beam_along_a_line_of_the_lattice_stays_beside_it() -> None:
    for sensor, end in (((0.0, 0.1), (0.2, 0.1)), ((0.2, 0.1), (0.0, 0.1))):
        cells = traced(sensor, [end], [True])
        assert {row for row, _ in cells} == {2}
        assert {col for _, col in cells} == {0, 1, 2, 3, 4}


@pytest.mark.parametrize("seed", range(5))
def test_ends_of_every_kind_of_reading(seed: int) -> None:
    rng = np.random.default_rng(seed)
    ranges = rng.uniform(0.0, 7.0, 40)
    ranges[::5] = rng.choice([math.nan, math.inf, -1.0, 0.0], 8)
    ranges[20:28] = math.inf
    ranges[24] = rng.choice([math.nan, math.inf, 2.0])
    scan = Scan(ranges, rng.uniform(-3, 3, 40), 6.0, 0.5, mount=Pose2(*rng.normal(size=3)))
    pose = Pose2(*rng.normal(size=3))
    sensor, ends, hit = Rays(reach=4.0, no_echo_reach=3.0).ends(scan, pose)
    naive_sensor, beams = naive.beams(scan, pose, 4.0, 3.0)
    np.testing.assert_allclose(sensor, naive_sensor)
    np.testing.assert_allclose(ends, [end for end, _ in beams])
    assert hit.tolist() == [h for _, h in beams]


@pytest.mark.parametrize("missed", [0.02, 0.1, 0.3, 0.4])
def test_random_misses_of_a_wall_show_no_free_cells(missed: float) -> None:
    rng = np.random.default_rng(0)
    shown = 0
    for _ in range(100):
        ranges = np.where(rng.random(181) < missed, math.inf, 2.0)
        scan = Scan(ranges, np.linspace(-1.5, 1.5, 181), 8.0)
        shown += (~Rays().ends(scan, Pose2())[2]).sum()
    assert shown < 100  # of 18,100 beams


@pytest.mark.parametrize("missed", [0.0, 0.1, 0.3])
def test_a_passage_with_no_end_in_reach_is_free_for_a_laser_that_misses_echoes(missed) -> None:
    rng = np.random.default_rng(0)
    ranges = np.where(rng.random(181) < missed, math.inf, 2.0)
    ranges[80:101] = math.inf
    _, ends, hit = Rays().ends(Scan(ranges, np.linspace(-1.5, 1.5, 181), 8.0), Pose2())
    assert (~hit).sum() >= 19
    assert np.hypot(*ends[~hit].T) == pytest.approx(8.0)


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


def test_a_point_that_rounding_puts_across_the_border_has_a_cell() -> None:
    cells = traced((0.5, -1e-17), [(0.7, -0.1)], [True])
    hits = [cell for cell, hit in cells.items() if hit]
    assert len(hits) == 1
    assert hits[0] in [(-3, 13), (-2, 13), (-3, 14), (-2, 14)]


def test_a_map_far_from_the_origin_is_not_larger() -> None:
    tiles = Tiles(RESOLUTION)
    trace(tiles, (100.2, -200.2), [(100.4, -200.4)], [True])
    assert tiles.index.size <= 9
    assert tiles.used <= 5


def test_only_what_was_seen_takes_memory() -> None:
    tiles = Tiles(RESOLUTION)
    trace(tiles, (0.5, 0.5), [(40.5, 0.5), (0.5, 40.5)], [True, True])  # an L, not its square
    assert tiles.used - 1 <= 2 * math.ceil(40 / 3.2) + 6
    assert tiles.index.size > 150
    assert id_of(tiles, (600, 600)) < AREA
