"""The poses of earlier scans are kept each time that a SLAM moved them."""

from __future__ import annotations

import numpy as np
import pytest

from slam.benchmark.revisions import MOVED, Revisions
from slam.geometry import Array, Pose2
from slam.grid import OccupancyGrid
from slam.interface import Estimate
from slam.maps.static import Static
from slam.scan import Scan

FARTHEST = MOVED[0]


class Moving:
    """A SLAM that drives along the x axis, and moves its earlier poses sideways by `offset`."""

    def __init__(self) -> None:
        self.pose = Pose2()
        self.online: list[Pose2] = []
        self.offset = 0.0

    def update(self, displacement: Pose2, scan: Scan) -> Estimate:
        raise NotImplementedError

    def drive(self, moved: float) -> Estimate:
        self.offset += moved
        self.online.append(Pose2(float(len(self.online)), self.offset, 0.0))
        return Estimate(self.online[-1], np.eye(3), 0.0, True, revised=moved != 0.0)

    def trajectory(self) -> Array:
        return np.array([[k, self.offset, 0.0] for k in range(len(self.online))])

    def finish(self) -> None:
        raise NotImplementedError

    def map(self) -> OccupancyGrid:
        return Static().cells.grid()


def driven(*moved: float) -> list[Array]:
    """The poses that are kept of a drive in which each scan moves the earlier ones."""
    slam = Moving()
    revisions = Revisions(slam)
    for each in moved:
        revisions.take(slam.drive(each))
    return revisions.poses


def test_each_move_is_kept_with_the_scan_that_made_it() -> None:
    kept = driven(0.0, 0.0, 1.0, 0.0, -2.0)
    assert [len(poses) for poses in kept] == [3, 5]
    assert kept[0] == pytest.approx(np.array([[0.0, 1.0, 0.0], [1.0, 1.0, 0.0], [2.0, 1.0, 0.0]]))
    assert (kept[1][:, 1] == -1.0).all()


def test_small_moves_are_kept_once_they_add_up() -> None:
    small = 0.6 * FARTHEST
    assert not driven(0.0, small)
    kept = driven(0.0, small, small, small, small)
    assert [len(poses) for poses in kept] == [3, 5]


def test_without_a_move_nothing_is_kept() -> None:
    assert not driven(0.0, 0.0, 0.0)
