# pyright: reportMissingImports=false
import math
from itertools import pairwise

import numpy as np
import pytest
from dynslam_cli.console.process_memory import forget_peak, peak_mb, resident_mb
from dynslam_cli.speed.building import (
    BAND_WIDTH,
    LASER,
    MAX_MAP_MB,
    SCAN_DISTANCE,
    building,
    building_rows,
    building_table,
    different,
    scans,
    survey,
)
from rich.console import Console

import slam
from dynslam_env.worlds.clearance import any_crossing
from slam import registry
from slam.algorithms.variants import maximum_likelihood
from slam.geometry import transform_points
from slam.maps.static import Static


def untracked(items, description):
    return items


@pytest.fixture(scope="module")
def place():
    return building(2 * BAND_WIDTH)


def test_its_walls_are_rooms_along_corridors(place):
    lengths = np.hypot(*(place.walls[:, 2:] - place.walls[:, :2]).T)
    rooms, bands = 4, 2
    outer, back, front, between = (
        3 * 40.0,
        bands * 40.0,
        bands * rooms * 2 * 9.0,
        2 * rooms * 2 * 8.5,
    )
    assert lengths.sum() == pytest.approx(outer + back + front + between)


def test_the_way_leads_into_every_room_and_through_no_wall(place):
    x, y = place.poses[:, :2].T
    for row in range(2):
        for depth in (BAND_WIDTH * row + 4.25, BAND_WIDTH * row + 10.0, BAND_WIDTH * row + 15.75):
            for room in range(4):
                assert (np.hypot(x - 10 * room - 5, y - depth) < SCAN_DISTANCE).any()
    moves = np.array([[*a[:2], *b[:2]] for a, b in pairwise(place.poses)])
    along = np.hypot(*(moves[:, 2:] - moves[:, :2]).T)
    between_bands = along > 1.01 * SCAN_DISTANCE
    assert between_bands.sum() <= 1
    assert not any_crossing(moves[~between_bands], place.walls)


def test_a_scan_ends_at_the_walls(place):
    pose, scan = next(scans(place))
    echoes = transform_points(pose, scan.points)
    assert len(echoes) > 0.9 * LASER.beams
    a, b = place.walls[:, None, :2], place.walls[:, None, 2:]
    t = ((echoes - a) * (b - a)).sum(-1) / ((b - a) ** 2).sum(-1)
    away = np.linalg.norm(echoes - (a + np.clip(t, 0, 1)[..., None] * (b - a)), axis=-1)
    assert away.min(axis=0).max() < 6 * LASER.sigma


@pytest.mark.parametrize("variant", ["static-ml", "dynamic-ml"])
def test_all_of_it_is_seen_and_each_cell_costs_what_it_ever_costs(variant, place):
    row = survey(variant, place, untracked)
    assert row["observed"] > 0.98
    assert row["map_mb"] < row["read_mb"]
    one = survey(variant, building(BAND_WIDTH), untracked)
    tiles = math.ceil(2 * BAND_WIDTH / 3.2) ** 2, math.ceil(BAND_WIDTH / 3.2) ** 2
    assert row["map_mb"] / one["map_mb"] == pytest.approx(tiles[0] / tiles[1], rel=0.3)
    if resident_mb():
        assert 0.5 * row["map_mb"] < row["map_peak_mb"] <= row["read_peak_mb"] < 4 * row["read_mb"]


def test_a_static_map_of_the_whole_building_fits(place):
    row = survey("static-ml", place, untracked)
    assert row["read_mb"] / row["observed"] * (200 / (2 * BAND_WIDTH)) ** 2 < MAX_MAP_MB


class Fat(Static):
    """Ten times as many bytes a cell."""

    @property
    def nbytes(self):
        return 10 * self.cells.tiles.nbytes


def test_each_kind_of_map_and_reading_is_surveyed_once(monkeypatch):
    monkeypatch.setattr(registry, "_BUILDERS", dict(registry._BUILDERS))
    slam.register("fat-ml", maximum_likelihood(Fat))
    names = ["odometry", "static-ml", "clamped-ml", "static-ml/beta1", "fat-ml"]
    assert different(names) == ["static-ml", "clamped-ml", "fat-ml"]
    static, _, fat = building_rows(names, BAND_WIDTH, untracked)
    assert fat["map_mb"] == pytest.approx(10 * static["map_mb"])


def test_what_is_too_much_is_marked():
    row = {"what": "a", "side": 200.0, "resolution": 0.05, "observed": 1.0}
    row |= {"map_mb": 599.0, "map_peak_mb": 601.0, "read_mb": 0.0, "read_peak_mb": 700.0}
    console = Console(width=80, record=True, quiet=True)
    with console.capture() as shown:
        console.quiet = False
        console.print(building_table([row]))
    line = next(line for line in shown.get().splitlines() if line.strip().startswith("a  "))
    assert line.split() == ["a", "100.0%", "599", "601", "!", "0", "700", "!"]


@pytest.mark.skipif(not resident_mb(), reason="the system does not tell")
def test_the_peak_is_that_since_it_was_forgotten():
    before = resident_mb()  # gives back what is free, so that the peak would be above it
    forget_peak()
    assert peak_mb() == pytest.approx(before, abs=5)
    held = np.ones(100_000_000 // 8)
    assert resident_mb() - before == pytest.approx(100, abs=5)
    del held
    assert resident_mb() - before == pytest.approx(0, abs=5)
    assert peak_mb() - before == pytest.approx(100, abs=5)
    forget_peak()
    assert peak_mb() - before == pytest.approx(0, abs=5)
