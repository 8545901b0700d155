from dataclasses import replace

import numpy as np
import pytest

from slam.benchmark.run import run
from slam.episode import Episode
from slam.errors import InputError
from slam.geometry import Pose2
from slam.preprocessing.clock import Clock, with_clock
from slam.preprocessing.several_lasers import merged
from slam.registry import make
from tests.slam.worlds import drive, loop, scan_at

FRONT, BACK = Pose2(0.2, 0.0, 0.0), Pose2(-0.2, 0.05, np.pi)
HALF = np.radians(np.arange(-90, 91, 2.0))


def of_laser(mount: Pose2, late: float = 0.0, n: int = 150) -> Episode:
    """The drive around the room by a laser at `mount`, whose scans come `late` s."""
    whole = drive(n, bias=0.02)
    rng = np.random.default_rng(1)
    times = whole.times
    poses = [Pose2.of(pose) for pose in loop(n)]
    scans = [
        scan_at(pose, time + late, HALF, mount=mount, rng=rng)
        for pose, time in zip(poses, times, strict=True)
    ]
    return Episode(tuple(scans), whole.odometry, meta={"laser": f"/at{mount.x}"})


def test_scans_are_in_the_order_of_time_each_with_its_mount() -> None:
    both = merged([of_laser(FRONT), of_laser(BACK, late=0.03)])
    assert len(both.scans) == 300
    assert (np.diff(both.times) > 0).all()
    assert [scan.mount for scan in both.scans[:4]] == [FRONT, BACK, FRONT, BACK]
    assert both.meta["laser"] == "/at0.2 + /at-0.2"


def test_scans_of_the_same_stamp_are_both_kept() -> None:
    both = merged([of_laser(FRONT), of_laser(BACK)])
    assert len(both.scans) == 300
    assert 0 < np.diff(both.times).min() < 1e-5


def test_lasers_with_different_clocks_are_put_on_one() -> None:
    """Each was found to differ from the odometry by another offset: a scan of the same moment must
    get the same stamp."""
    front = with_clock(of_laser(FRONT), Clock(offset=0.1))
    back = with_clock(of_laser(BACK, late=-0.2), Clock(offset=0.3))
    both = merged([front, back])
    by_mount = {m: [s.time for s in both.scans if s.mount == m] for m in (FRONT, BACK)}
    assert np.abs(np.subtract(by_mount[FRONT], by_mount[BACK])).max() < 1e-5


def test_two_lasers_see_more_than_one_and_find_the_way() -> None:
    two = merged([of_laser(FRONT), of_laser(BACK, late=0.03)])
    begun = [run(make("static-ml"), replace(one, scans=one.scans[:4])).grid.observed.sum()
             for one in (of_laser(FRONT), two)]  # fmt: skip
    assert begun[1] > 1.3 * begun[0]
    poses = run(make("static-ml"), two).poses[::2]
    truth = loop(150)
    start = Pose2.of(truth[0])
    found = np.array([start @ Pose2.of(pose) for pose in poses])
    assert np.hypot(*(found - truth)[:, :2].T).max() < 0.05


def test_one_laser_stays_as_it_is_and_a_truth_is_refused() -> None:
    one = of_laser(FRONT)
    assert merged([one]) is one
    with pytest.raises(InputError, match="truth"):
        merged([drive(20), replace(drive(20), truth=None)])
