"""Worlds from maps: walls where the cells are, doors that close their gaps, paths in free space."""

import math
import re

import gymnasium as gym
import numpy as np
import pytest

from dynslam_env import FromMap
from dynslam_env.simulation.find_world import find_world
from dynslam_env.worlds.map_doors import hung
from dynslam_env.worlds.map_walls import simplified
from slam import InputError
from slam.grid import GridSpec, OccupancyGrid
from slam.io.ros_map import write_ros_map
from tests.dynslam_env.worlds.naive import along, covers, distances

CELL = 0.05  # m
DOORS = """{{"type": "FeatureCollection", "features": [{{"type": "Feature", "geometry": {{"type":
"Polygon", "coordinates": [[[3.0, 1.95], [4.0, 1.95], [4.0, 2.05], [3.0, 2.05], [3.0, 1.95]]]}},
"properties": {{"kind": "door", "probability": {}}}}}]}}"""


@pytest.fixture
def place(tmp_path):
    """Two rooms of 8 x 2 m, y from 0 to 2 and 2 to 4, and a gap in the wall at x = 3 to 4 m."""
    occupied = np.zeros((100, 180))
    occupied[8:92, 8:172] = 1.0
    occupied[10:49, 10:170] = occupied[51:90, 10:170] = 0.0
    occupied[49:51, 70:90] = 0.0
    observed = np.ones_like(occupied, dtype=bool)
    observed[:8] = observed[92:] = observed[:, :8] = observed[:, 172:] = False
    grid = OccupancyGrid(GridSpec(CELL, -10, -10, 100, 180), occupied, observed)
    write_ros_map(grid, tmp_path / "map.yaml")
    (tmp_path / "doors.geojson").write_text(DOORS.format(0.7))
    return tmp_path


def drawn(world, seed=0):
    return world.layout(np.random.default_rng(seed))


def test_walls_are_few_and_where_the_cells_end(place):
    walls = drawn(FromMap(place)).walls
    assert len(walls) < 40
    ends = walls.reshape(-1, 2)
    for point in ((0.0, 1.0), (8.0, 3.0), (6.0, 0.0), (6.0, 1.95), (6.0, 2.05)):
        assert distances(np.array([point]), walls)[0] < 0.06
    assert distances(np.array([(4.0, 1.0)]), walls)[0] > 0.85
    assert ends.min(axis=0) == pytest.approx((-1.5, -1.5))  # the fence, 1 m outside of the map


def test_a_found_door_closes_its_gap_and_moves(place):
    layout = drawn(FromMap(place))
    (door,) = layout.doors
    assert door.width == pytest.approx(0.998)
    assert door.hinge[0] == pytest.approx(3.0) or door.hinge[0] == pytest.approx(4.0)
    assert abs(door.hinge[1] - 2.0) == pytest.approx(0.02)
    env = gym.make("DoorOffice-v0", world=FromMap(place), max_episode_steps=400)
    env.reset(seed=0)
    angles = [env.step(np.zeros(2, np.float32))[4]["door_angles"][0] for _ in range(300)]
    assert min(angles) < 0.1 < 1.5 < max(angles)


def test_a_door_hangs_where_no_wall_is_in_its_way():
    gap = np.array([(0.0, 0.0), (1.0, 0.0)])
    walls = np.array([(0.05, 0.9, 0.15, 0.9), (0.4, -0.3, 0.6, -0.3)])
    door = hung(gap, walls)
    assert door.hinge == pytest.approx((1.0, 0.02))
    assert not covers(door, np.array([(0.1, 0.9), (0.5, -0.3)])).any()


@pytest.mark.parametrize("seed", range(20))
def test_paths_keep_away_from_walls_and_leaves(place, seed):
    layout = drawn(FromMap(place, length=12.0), seed)
    way = along(layout.path)
    assert distances(way, layout.walls).min() > 0.25
    assert not covers(layout.doors[0], way, 0.22).any()
    assert layout.path[0].tolist() == layout.path[-1].tolist() == list(layout.start[:2])
    length = np.hypot(*np.diff(layout.path, axis=0).T).sum()
    assert 1.0 < length <= 12.0 + 1e-9
    assert layout.start.theta == pytest.approx(math.atan2(*(layout.path[1] - layout.path[0])[::-1]))


def test_without_doors_there_are_none_and_the_path_passes_the_gap(place):
    (place / "doors.geojson").unlink()
    world = FromMap(place / "map.yaml")
    paths = [drawn(world, seed).path for seed in range(20)]
    assert not drawn(world).doors
    assert any(np.ptp(path[:, 1]) > 1.5 for path in paths)


def test_uncertain_doors_are_left_out(place):
    assert not drawn(FromMap(place, least_probability=0.8)).doors


def test_another_map_is_another_world(place):
    before = FromMap(place)
    (place / "doors.geojson").write_text(DOORS.format(0.1))
    assert FromMap(place) != before
    env = gym.make("DoorCorridor-v0", world=before).unwrapped
    assert env.get_wrapper_attr("config")["world"]["content"] == before.content


def test_the_world_of_a_map_by_name(place):
    text = str(place / "map.yaml")
    assert find_world(text) == FromMap(text)


def test_what_is_no_map_or_no_door_is_told(place):
    with pytest.raises(InputError, match="no free space 3 m away"):
        FromMap(place, clearance=3.0)
    for text in ("no json", "{}", '{"features": [{}]}', DOORS.format('"x"')):
        (place / "doors.geojson").write_text(text)
        with pytest.raises(
            InputError, match=r"doors.geojson: not a file of doors that `dynslam map`"
        ):
            FromMap(place)
    with pytest.raises(InputError, match=re.escape("nowhere.yaml")):
        FromMap(place / "nowhere.yaml")


def test_simplifying_keeps_within_the_tolerance():
    angles = np.linspace(0, math.tau, 400)
    ring = 3.0 * np.column_stack([np.cos(angles), np.sin(angles)])
    kept = simplified(ring, 0.05)
    assert len(kept) < 40
    assert distances(ring, np.hstack([kept[:-1], kept[1:]])).max() <= 0.05
