"""The poses of earlier scans are kept each time that a SLAM moved them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest

from slam.benchmark.revisions import MOVED
from slam.benchmark.run import run
from slam.geometry import Array, Pose2
from slam.grid import OccupancyGrid
from slam.interface import Estimate
from slam.maps.static import Static
from slam.scan import Scan
from tests.slam.worlds import drive

FARTHEST, MOST_TURNED = MOVED


class Move(NamedTuple):
    """Of the whole path: m, sideways, and rad, of the headings."""

    aside: float = 0.0
    turned: float = 0.0


STAYS = Move()


class Moving:
    """A SLAM that drives along the x axis; each scan moves its whole path, and so does the end."""

    def __init__(self, moves: tuple[Move, ...]) -> None:
        self.pose = Pose2()
        self._moves = iter(moves)
        self._path = np.zeros((0, 3))

    def update(self, displacement: Pose2, scan: Scan) -> Estimate:
        move = next(self._moves)
        last = self._path[-1, 1:] if len(self._path) else (0.0, 0.0)
        self._path = np.vstack([self._path, [float(len(self._path)), *last]]) + [0.0, *move]
        self.pose = Pose2.of(self._path[-1])
        return Estimate(self.pose, np.eye(3), 0.0, True, revised=move != STAYS)

    def trajectory(self) -> Array:
        return self._path

    def finish(self) -> None:
        self._path = self._path + [0.0, 1.0, 0.0]

    def map(self) -> OccupancyGrid:
        return Static().cells.grid()


def driven(*moves: Move) -> tuple[Array, ...]:
    """The poses that are kept of a drive with these moves, and a last scan."""
    return run(Moving((*moves, STAYS)), drive(len(moves) + 1)).revisions


def test_each_move_is_kept_with_the_scan_that_made_it() -> None:
    kept = driven(STAYS, STAYS, Move(1.0), STAYS, Move(-2.0))
    assert [len(poses) for poses in kept] == [3, 5]
    assert kept[0] == pytest.approx(np.array([[0.0, 1.0, 0.0], [1.0, 1.0, 0.0], [2.0, 1.0, 0.0]]))
    assert (kept[1][:, 1] == -1.0).all()


@pytest.mark.parametrize("small", [Move(0.6 * FARTHEST), Move(turned=0.6 * MOST_TURNED)])
def test_small_moves_are_kept_once_they_add_up(small: Move) -> None:
    assert not driven(STAYS, small)
    assert [len(poses) for poses in driven(STAYS, small, small, small, small)] == [3, 5]


def test_without_a_move_nothing_is_kept() -> None:
    assert not driven(STAYS, STAYS, STAYS)


def test_what_the_end_moves_is_no_revision_that_a_scan_made() -> None:
    assert not run(Moving((STAYS, STAYS, Move(1.0))), drive(3)).revisions
