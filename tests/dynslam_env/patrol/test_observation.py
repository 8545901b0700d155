import math

import numpy as np
import pytest

from dynslam_env.patrol.memory import MIN_WATCH_TIME, DynamicMap
from dynslam_env.patrol.observation import (
    AGE_SCALE,
    LAYERS,
    MAP_PIXELS,
    MAX_FLIP_RATE,
    PIXEL_SIZE,
    SCAN_SECTORS,
    certainty,
    draw_map,
    observation_space,
    observe,
    sectors,
)
from slam import Pose2
from slam.geometry import transform_points, turned

from .drawn import fan, wall

UNSEEN_PIXEL = [128, 0, 255, 0]  # what is drawn where nothing was seen


def drawn(memory, pose, time):
    image = np.full((len(LAYERS), MAP_PIXELS, MAP_PIXELS), 77, np.uint8)
    draw_map(memory, pose, time, image)
    return image


def sample(memory, point, time):
    """P(occupied), age and flips of the cell at a point; None where it was never seen."""
    known, tiles = memory.map, memory.map.cells.tiles
    grid, ahead = known.cells.grid(), known.predicted(time)
    row, col = grid.spec.cells(point[None])[0]
    if not (0 <= row < grid.spec.rows and 0 <= col < grid.spec.cols) or not grid.observed[row, col]:
        return None
    changes = int(tiles.dense(known.counts)[row, col].sum())
    occupied = (ahead if changes else grid).occupied[row, col]
    watched = max(tiles.dense(known.times)[row, col].sum(), MIN_WATCH_TIME)
    return occupied, time - tiles.dense(known.last)[row, col], changes / watched


def pixel(memory, pose, time, row, col):
    """By the table in `DoorPatrolEnv`: a pixel is four samples."""
    x, y = ((MAP_PIXELS - 1) / 2 - row) * PIXEL_SIZE, ((MAP_PIXELS - 1) / 2 - col) * PIXEL_SIZE
    quarter = PIXEL_SIZE / 4
    corners = [(x + a, y + b) for a in (-quarter, quarter) for b in (-quarter, quarter)]
    found = [sample(memory, transform_points(pose, np.array(c)), time) for c in corners]
    found = [one for one in found if one is not None]
    if not found:
        return UNSEEN_PIXEL
    occupied, age, flips = (max(values) for values in zip(*found, strict=True))
    shown = [
        occupied,
        len(found) / 4,
        1 - math.exp(-age / AGE_SCALE),
        min(flips / MAX_FLIP_RATE, 1),
    ]
    return [int(255 * value) for value in shown]


@pytest.fixture(scope="module")
def walked():
    """A memory with walls, a door, and an age."""
    memory, rng = DynamicMap(), np.random.default_rng(3)
    for k in range(60):
        ahead = 2.03 if k // 20 % 2 else 3.7
        memory.look(wall(ahead, 0.3 * k), Pose2(0.01, 0.02, 0.0))
    for k in range(20):
        ranges = rng.uniform(0.6, 5.0, 31)
        memory.look(fan(ranges, 20 + 0.4 * k, 2.5), Pose2.of((*rng.uniform(-2, 2, 2), 0.3 * k)))
    return memory


@pytest.mark.parametrize("seed", range(5))
def test_the_map_is_what_a_slow_look_at_each_pixel_finds(walked, seed):
    rng = np.random.default_rng(seed)
    pose = Pose2.of((*rng.uniform(-4, 4, 2), rng.uniform(-math.pi, math.pi)))
    image = drawn(walked, pose, 33.0)
    seen = image[1] > 0
    assert 0.05 < seen.mean() < 0.95
    at = (
        rng.permutation(np.argwhere(seen))[:30].tolist()
        + rng.integers(0, MAP_PIXELS, (30, 2)).tolist()
    )
    for row, col in at:
        expected = pixel(walked, pose, 33.0, row, col)
        np.testing.assert_allclose(image[:, row, col].astype(int), expected, atol=1)
    assert set(np.unique(image[1])) <= {0, 63, 127, 191, 255}


def test_something_restless_was_drawn(walked):
    assert (drawn(walked, Pose2(), 33.0)[3] > 50).sum() >= 4


def test_ahead_is_up_and_left_is_left():
    memory = DynamicMap()
    memory.look(wall(2.03), Pose2())
    ahead = drawn(memory, Pose2(), 0.0)[0] > 200
    rows = np.flatnonzero(ahead.any(axis=1))
    assert set(rows) <= {11, 12}  # 8 pixels ahead of the middle, between 19 and 20
    left = drawn(memory, Pose2(0.0, 0.0, -math.pi / 2), 0.0)[0] > 200
    assert set(np.flatnonzero(left.any(axis=0))) == set(rows)


def test_outside_of_all_that_was_seen_nothing_is_known(walked):
    for pose in (Pose2(300.0, -200.0, 1.0), Pose2(-1e5, 1e5, 0.0)):
        image = drawn(walked, pose, 33.0)
        assert (image == np.array(UNSEEN_PIXEL)[:, None, None]).all()


def test_each_sector_has_its_nearest_echo_right_to_left():
    ranges = np.full(2 * SCAN_SECTORS, 6.0)
    ranges[0], ranges[3], ranges[-1] = 1.0, 2.0, 4.0
    found = sectors(fan(ranges))
    assert found.dtype == np.float32
    expected = np.full(SCAN_SECTORS, 6.0 / 8.0)
    expected[[0, 1, -1]] = 1 / 8, 2 / 8, 4 / 8
    assert found == pytest.approx(expected)


@pytest.mark.parametrize("none", [np.inf, np.nan, 8.0, 9.0, 0.0, 0.01, -1.0])
def test_what_is_no_echo_is_one(none):
    assert (sectors(fan(np.full(181, none))) == 1.0).all()


def test_fewer_beams_than_sectors_leave_some_of_them_empty():
    found = sectors(fan([4.0, 4.0, 4.0]))
    assert np.flatnonzero(found < 1).tolist() == [0, 8, 16]


def test_certainty_of_a_robot_that_looks_along_x():
    shown, correlations = certainty(Pose2(), np.diag([1e-2, 1e-1, 1e-3]) ** 2)
    assert shown == pytest.approx([1 / 3, 2 / 3, 0.0], abs=1e-6)
    assert correlations == pytest.approx([0.0, 0.0, 0.0])


def test_certainty_is_bounded():
    shown, _ = certainty(Pose2(), np.diag([0.0, 1e-9, 1e9]))
    assert shown == pytest.approx([0.0, 0.0, 1.0])
    most = np.full((3, 3), 0.04)
    assert certainty(Pose2(), most)[1] == pytest.approx([1.0, 1.0, 1.0])


@pytest.mark.parametrize("theta", [0.0, math.pi / 2, -2.2, 3.0])
def test_certainty_is_the_robots_own_wherever_it_looks(theta):
    deviations = np.array([0.02, 0.2, 0.05])
    correlated = np.array([[1.0, 0.5, -0.25], [0.5, 1.0, 0.125], [-0.25, 0.125, 1.0]])
    own = correlated * np.outer(deviations, deviations)
    world = turned(theta) @ own @ turned(theta).T
    shown, correlations = certainty(Pose2(5.0, -3.0, theta), world)
    assert shown == pytest.approx(np.log(deviations / 1e-3) / np.log(1e3), abs=1e-6)
    assert correlations == pytest.approx([0.5, -0.25, 0.125], abs=1e-6)


def test_all_of_it_is_in_its_space(walked):
    scan, covariance = wall(2.0, 33.0), np.diag([1e-4, 1e-4, 1e-4])
    for velocity in ((0.4, -0.75), (9.0, -9.0)):
        found = observe(walked, Pose2(), covariance, scan, np.array(velocity), (0.8, 1.5))
        assert found in observation_space()
        expected = np.clip((velocity[0] / 0.8, velocity[1] / 1.5), -1, 1)
        assert found["velocity"] == pytest.approx(expected)
