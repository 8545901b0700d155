"""A real recording: two lasers, odometry and mountings in /tf, and a reference system."""

from pathlib import Path

import numpy as np
import pytest

import slam
from slam.benchmark.run import run
from slam.errors import InputError
from slam.geometry import Pose2, compose
from slam.io.bags import read_bag, read_reference
from slam.io.loaded_recording import SourceSelection
from slam.metrics.reference import score_reference
from slam.metrics.trajectory import alignment, ate
from slam.preprocessing.clock import estimated_clock, synchronised
from slam.preprocessing.deskewing import deskewed
from slam.trajectory import Trajectory

SECURITY = "/driver_laser_security/laser_scan"
NAVIGATION = "/driver_laser_navigation/laser_scan"


@pytest.fixture(scope="module")
def jarvis(shared_data: Path) -> Path:
    return shared_data / "jarvis_circular.bag"


def test_its_lasers_are_listed(jarvis: Path) -> None:
    with pytest.raises(
        InputError, match=rf"several lasers, choose one \(--laser\): {NAVIGATION}, {SECURITY}"
    ):
        read_bag(jarvis)


@pytest.mark.parametrize(
    ("laser", "scans", "beams", "ahead"),
    [(SECURITY, 213, 761, 0.895), (NAVIGATION, 204, 1440, 0.194)],
)
def test_what_is_in_it(jarvis: Path, laser: str, scans: int, beams: int, ahead: float) -> None:
    log = read_bag(jarvis, SourceSelection(laser))
    assert log.warnings == ()
    assert len(log.episode.scans) == scans
    assert {len(one.ranges) for one in log.episode.scans} == {beams}
    assert {one.mount for one in log.episode.scans} == {Pose2(ahead, 0.0, 0.0)}
    assert log.episode.meta["odometry"] == "/tf: base_footprint in odom"


@pytest.mark.parametrize("variant", ["dynamic-graph", "hmm-ml"])
def test_its_path_within_three_centimetres(jarvis: Path, variant: str) -> None:
    drive = deskewed(read_bag(jarvis, SourceSelection(SECURITY)).episode)
    truth = read_reference(jarvis, "/pose_ground_truth").at(drive.times)
    found = np.asarray(run(slam.make(variant), drive).poses)
    assert ate(compose(np.array(alignment(found, truth)), found), truth) <= 0.03


@pytest.mark.parametrize("variant", ["static-ml", "dynamic-graph"])
def test_the_path_of_its_navigation_laser_by_the_estimated_clock(
    jarvis: Path, variant: str
) -> None:
    """21 mm without it: the stamps are of the end of the sweep."""
    log = read_bag(jarvis, SourceSelection(NAVIGATION))
    drive = deskewed(synchronised(log.episode))
    truth = read_reference(jarvis, "/pose_ground_truth")
    found = Trajectory(drive.times, run(slam.make(variant), drive).poses)
    assert score_reference(truth, found).ate_aligned <= 0.013


def test_its_clocks(jarvis: Path) -> None:
    navigation, security = (
        estimated_clock(read_bag(jarvis, SourceSelection(laser)).episode)
        for laser in (NAVIGATION, SECURITY)
    )
    assert navigation.end
    assert navigation.offset == pytest.approx(-0.06, abs=0.02)
    assert not security.end  # its bag does not state how long a sweep takes
    assert security.offset == pytest.approx(-0.08, abs=0.02)
    assert max(navigation.deviation, security.deviation) < 0.01
