import math

import numpy as np
import pytest

from slam.geometry import Pose2, compose
from slam.layers.wall_direction import wall_direction
from slam.scan import Scan
from tests.slam.layers.rooms import box, watch

ROOM = np.concatenate([box(-4.02, -2.02, 4.02, 2.02), [(2.0, -2.0, 3.0, -1.0)]])
"""A room with an oblique corner."""
POSES = [Pose2(x, y, 0.1) for x in (-2.0, 0.0, 2.0) for y in (-1.0, 0.0, 1.0)]


@pytest.mark.parametrize("degrees", [0.0, 3.3, 30.0, -44.0, 44.0, 70.0, 133.0])
def test_the_direction_of_most_walls_is_found(degrees: float) -> None:
    scans, poses = watch([ROOM] * len(POSES), POSES)
    turned = compose(np.array([1.0, -2.0, math.radians(degrees)]), poses)
    found = math.degrees(wall_direction(scans, turned))
    assert -45.0 < found <= 45.0
    off = (found - degrees + 45.0) % 90.0 - 45.0
    assert abs(off) <= 0.15


def test_without_walls_nothing_is_turned() -> None:
    empty = Scan(np.full(10, np.inf), np.linspace(-1, 1, 10), 8.0)
    assert wall_direction([empty], np.zeros((1, 3))) == 0.0
