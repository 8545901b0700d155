from itertools import islice

import numpy as np
import pytest

from slam.algorithms.dead_reckoning import DeadReckoning
from slam.algorithms.maximum_likelihood import MaximumLikelihood
from slam.benchmark.run import Playback, Run, run, true_start, warm_up
from slam.episode import Episode
from slam.errors import InputError
from slam.geometry import Pose2
from slam.grid import GridSpec, OccupancyGrid
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
    assert Run(np.zeros((10, 3)), grid, matched, seconds=2.0).ms_per_matched_scan == ms


def test_the_true_start_is_the_first_true_pose(episode) -> None:
    assert true_start(episode) == Pose2.of(episode.truth.poses[0]) != Pose2()
    assert true_start(Episode(episode.scans, episode.odometry)) == Pose2()


def test_warming_up_takes_any_known_variant_and_any_length(episode) -> None:
    warm_up("dynamic-ml", Episode(episode.scans[:2], episode.odometry))
    with pytest.raises(InputError, match="known"):
        warm_up("none", episode)
