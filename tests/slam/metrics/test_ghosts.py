import numpy as np
import pytest

from slam.episode import Episode, Truth
from slam.errors import InputError
from slam.geometry import Pose2
from slam.grid import GridSpec, OccupancyGrid
from slam.metrics.ghosts import Ghosts, seen_through
from slam.metrics.raster import rasterise
from slam.trajectory import Trajectory
from tests.slam.layers.rooms import box, watch

ROOM = box(-2.02, -1.02, 2.02, 1.02)
SCANS, POSES = watch([ROOM] * 5, [Pose2()] * 5)
TIMES = np.array([scan.time for scan in SCANS])
EPISODE = Episode(tuple(SCANS), Trajectory(TIMES, POSES), Truth(POSES, ROOM, np.empty((5, 0, 4))))
SPEC = GridSpec.around((-3.0, -2.0), (3.0, 2.0), 0.05)
WALLS = rasterise(ROOM, SPEC)


def grid(occupied: np.ndarray) -> OccupancyGrid:
    return OccupancyGrid(SPEC, occupied.astype(np.float64), np.ones(SPEC.shape, np.bool_))


def test_the_true_walls_hold_no_ghost() -> None:
    score = Ghosts(EPISODE).score(grid(WALLS))
    assert score.ghost_cells == 0
    assert score.wall_recall == score.hit_recall == 1.0


def test_what_stands_in_the_room_is_a_ghost() -> None:
    haunted = WALLS.copy()
    ((row, col),) = SPEC.cells(np.array([(0.51, 0.01)]))
    haunted[row, col : col + 3] = True
    judge = Ghosts(EPISODE)
    score = judge.score(grid(haunted))
    assert score.ghost_cells == 3
    assert score.ghosts_per_m == pytest.approx(3 / judge.metres)
    assert judge.metres == pytest.approx(12.16, rel=0.03)


def test_an_empty_map_has_no_ghosts_and_no_walls() -> None:
    score = Ghosts(EPISODE).score(grid(np.zeros_like(WALLS)))
    assert score == (0.0, 0, 0.0, 0.0)


def test_walls_that_are_8_cm_off_are_not_within_5_cm() -> None:
    score = Ghosts(EPISODE).score(grid(WALLS), Pose2(0.0, 0.08, 0.0))
    assert score.wall_recall > 0.95
    assert score.hit_recall < 0.6


def test_a_map_in_another_frame_is_moved() -> None:
    moved = Ghosts(EPISODE).score(grid(np.roll(WALLS, 10, axis=1)), Pose2(-0.5, 0.0, 0.0))
    assert moved.ghost_cells == 0
    assert Ghosts(EPISODE).score(grid(np.roll(WALLS, 10, axis=1))).ghost_cells > 0


def test_what_beams_went_through() -> None:
    counts = seen_through(EPISODE, np.array([(1.0, 0.0), (2.02, 0.0), (5.0, 0.0)]))
    assert counts.tolist() == [5, 0, 0]


def test_an_episode_without_truth_is_told() -> None:
    blind = Episode(EPISODE.scans, EPISODE.odometry)
    with pytest.raises(InputError, match="truth"):
        Ghosts(blind)
    with pytest.raises(InputError, match="holds the truth"):
        seen_through(blind, np.zeros((1, 2)))
