import numpy as np
import pytest

import slam
from agents import record_corridor
from slam.benchmark.run import Playback
from slam.benchmark.snapshots import SnapshotRecorder
from slam.episode import Episode

SCANS = 40


@pytest.fixture(scope="module")
def episode() -> Episode:
    drive = record_corridor(3, "moving")
    return Episode(drive.scans[:SCANS], drive.odometry)


@pytest.mark.parametrize("variant", ["dynamic-ml", "dynamic-graph"])
def test_stages_lie_evenly_and_the_last_is_the_result(variant: str, episode: Episode) -> None:
    playback = Playback(slam.make(variant), episode)
    growth = SnapshotRecorder(playback, stages=6)
    for number, _ in enumerate(playback):
        growth.after(number)
    stages, run = growth.stages(), playback.result()
    assert [stage.scan for stage in stages] == [0, 7, 14, 21, 28, 35, 39]
    assert (stages[-1].poses == run.poses).all()
    last, seen = stages[-1].grid, run.grid.observed
    assert (last.observed == seen).all()
    assert np.abs(last.occupied - run.grid.occupied)[seen].max() <= 0.005 + 1e-6
    assert growth.stages()[-1].scan == 39  # as often as one asks


def test_a_run_that_was_cut_off_ends_where_it_was(episode: Episode) -> None:
    playback = Playback(slam.make("dynamic-ml"), episode)
    growth = SnapshotRecorder(playback, stages=6)
    assert growth.stages() == []
    for number, _ in enumerate(playback):
        growth.after(number)
        if number == 9:
            break
    assert [stage.scan for stage in growth.stages()] == [0, 7, 9]
