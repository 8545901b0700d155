import time
from itertools import islice

import numpy as np
import pytest
from numba import njit

from slam.algorithms.dead_reckoning import DeadReckoning
from slam.algorithms.maximum_likelihood import MaximumLikelihood
from slam.benchmark.run import Playback, Run, run, true_start, warm_up
from slam.episode import Episode
from slam.errors import InputError
from slam.geometry import Pose2
from slam.grid import GridSpec, OccupancyGrid
from slam.interface import Estimate, Revising
from slam.scan import Scan
from tests.slam.worlds import drive


@pytest.fixture(scope="module")
def episode():
    return drive(30)


def test_what_was_done_so_far_can_be_had_at_any_time(episode) -> None:
    whole = run(MaximumLikelihood(), episode)
    playback = Playback(MaximumLikelihood(), episode)
    estimates = list(islice(playback, 12))
    part = playback.result()
    np.testing.assert_array_equal(part.poses, whole.poses[:12])
    np.testing.assert_array_equal(part.poses, [e.pose for e in estimates])
    assert part.matched == sum(e.matched for e in estimates) > 0
    assert 0 < part.grid.observed.sum() < whole.grid.observed.sum()
    assert part.seconds > 0


def test_before_the_first_scan_there_is_nothing(episode) -> None:
    nothing = Playback(DeadReckoning(), episode).result()
    assert nothing.poses.shape == (0, 3)
    assert (nothing.matched, nothing.seconds, nothing.ms_per_matched_scan) == (0, 0.0, 0.0)


def test_a_run_has_a_pose_per_scan(episode) -> None:
    done = run(DeadReckoning(), episode)
    assert done.poses.shape == (30, 3)
    assert done.matched == 0


@pytest.mark.parametrize(("matched", "ms"), [(4, 500.0), (0, 200.0)])
def test_time_is_spread_over_the_scans_that_were_matched(matched: int, ms: float) -> None:
    grid = OccupancyGrid(GridSpec(1.0, 0, 0, 0, 0), np.zeros((0, 0)), np.zeros((0, 0), bool))
    poses, spent = np.zeros((10, 3)), np.full(10, 0.2)
    assert Run(
        poses, poses, grid, matched, spent, np.zeros(len(poses)), np.zeros(len(poses))
    ).ms_per_matched_scan == pytest.approx(ms)


def test_the_true_start_is_the_first_true_pose(episode) -> None:
    assert true_start(episode) == Pose2.of(episode.truth.poses[0]) != Pose2()
    assert true_start(Episode(episode.scans, episode.odometry)) == Pose2()


def test_warming_up_takes_any_known_variant_and_any_length(episode) -> None:
    warm_up("dynamic-ml", Episode(episode.scans[:2], episode.odometry))
    with pytest.raises(InputError, match="known"):
        warm_up("none", episode)


class Shifting:
    """Comes to believe, with every scan and at the end, that all was a metre further left."""

    def __init__(self):
        self.pose, self.updates, self.finished = Pose2(), 0, []

    def update(self, displacement, scan):
        self.updates += 1
        self.pose = Pose2(float(self.updates))
        return Estimate(self.pose, np.zeros((3, 3)), 0.0, self.updates % 2 == 0, revised=True)

    def trajectory(self):
        shift = self.updates + 100 * len(self.finished)
        return np.array([(k, shift, 0.0) for k in range(self.updates)]).reshape(-1, 3)

    def map(self):
        occupied = np.full((1, 1), 0.1 * len(self.finished))
        return OccupancyGrid(GridSpec(1.0, 0, 0, 1, 1), occupied, np.ones((1, 1), bool))

    def finish(self):
        self.finished.append(self.updates)


def test_a_slam_that_revises_is_asked_what_it_believes_at_the_end(episode) -> None:
    robot = Shifting()
    assert isinstance(robot, Revising)
    done = run(robot, episode)
    assert robot.finished == [30]
    np.testing.assert_array_equal(done.poses, robot.trajectory())
    assert done.poses[:, 1].tolist() == [130.0] * 30
    assert done.online[:, 0].tolist() == list(range(1, 31))
    assert done.grid.occupied[0, 0] == 0.1  # the map is that after it
    assert done.matched == 15


def test_on_the_way_it_is_not_finished(episode) -> None:
    playback = Playback(robot := Shifting(), episode)
    assert playback.result().poses.shape == (0, 3)
    list(islice(playback, 12))
    part = playback.result()
    assert robot.finished == []
    assert part.poses[:, 1].tolist() == [12.0] * 12
    assert part.online.shape == (12, 3)


def test_it_is_finished_once_though_scans_are_alike(episode) -> None:
    run(robot := Shifting(), Episode((episode.scans[0],) * 3, episode.odometry))
    assert robot.finished == [3]


def test_one_that_does_not_revise_is_believed_as_it_goes(episode) -> None:
    done = run(DeadReckoning(), episode)
    assert not isinstance(DeadReckoning(), Revising)
    np.testing.assert_array_equal(done.poses, done.online)


class Doubtful(DeadReckoning):
    def update(self, displacement, scan):
        estimate = super().update(displacement, scan)
        return estimate._replace(lost=0.25 if estimate.pose.x < 0.1 else 0.75)


def test_a_run_keeps_how_probably_it_was_lost(episode) -> None:
    done = run(Doubtful(), episode)
    assert set(done.lost.tolist()) == {0.25, 0.75}
    assert done.lost.tolist() == [0.25 if x < 0.1 else 0.75 for x in done.online[:, 0]]
    assert run(DeadReckoning(), episode).lost.tolist() == [0.0] * 30


class Compiling(DeadReckoning):
    """Compiles a kernel at its third scan, and keeps the time of that."""

    def __init__(self):
        super().__init__()
        self.updates, self.compiling = 0, 0.0

    def update(self, displacement, scan):
        self.updates += 1
        if self.updates == 3:
            begun = time.perf_counter()
            njit(lambda x: x * x + 1)(3.0)
            self.compiling = time.perf_counter() - begun
        return super().update(displacement, scan)


def test_the_time_of_an_update_is_without_that_of_compiling(episode) -> None:
    slam = Compiling()
    done = run(slam, episode)
    assert slam.compiling > 0.02
    assert 0.0 < done.spent[2] < slam.compiling / 2
    assert done.seconds < slam.compiling + 0.5


def test_nothing_is_kept_on_the_scans_of_an_episode() -> None:
    """What a SLAM computes of a scan (its end points, its directions) stayed: 5.7 kB a scan."""
    shared = drive(20)
    run(MaximumLikelihood(), shared)
    fields = set(vars(Scan(np.ones(1), np.zeros(1), 5.0)))
    assert all(set(vars(scan)) == fields for scan in shared.scans)
