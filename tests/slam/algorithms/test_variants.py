import math

import numpy as np
import pytest

import slam
from slam.geometry import Pose2
from slam.interface import Revising
from tests.slam.worlds import loop, scan_at

REVISING = [name for name in slam.variants() if name.endswith(("-pf", "-graph"))]
WAY = [Pose2.of(pose) for pose in loop(90)[:30]]
SCANS = [scan_at(pose, 0.2 * k) for k, pose in enumerate(WAY)]


def test_which_there_are() -> None:
    assert len(REVISING) == 15
    assert "temporal-pf" not in REVISING
    assert not any(isinstance(slam.make(name), Revising) for name in ("static-ml", "odometry"))


@pytest.mark.parametrize("variant", REVISING)
def test_every_variant_drives_through_the_room(variant: str) -> None:
    robot = slam.make(variant, WAY[0])
    assert isinstance(robot, Revising)
    before = WAY[0]
    for pose, scan in zip(WAY, SCANS, strict=True):
        estimate = robot.update(before.between(pose), scan)
        assert math.dist(estimate.pose[:2], pose[:2]) < 0.05
        assert np.linalg.eigvalsh(estimate.covariance).min() > -1e-12
        before = pose
    robot.finish()
    assert robot.trajectory().shape == (30, 3)
    assert robot.map().observed.sum() > 1000
