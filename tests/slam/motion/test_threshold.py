import math

import pytest

from slam.geometry import Pose2
from slam.motion.threshold import MotionThreshold

SPACING = MotionThreshold(distance=0.5, turn=0.2, time=2.0)


@pytest.mark.parametrize(
    ("moved", "waited", "due"),
    [
        (Pose2(), 0.0, False),
        (Pose2(0.49, 0.0, 0.19), 1.99, False),
        (Pose2(0.3, -0.4, 0.0), 0.0, True),
        (Pose2(-0.5, 0.0, 0.0), 0.0, True),
        (Pose2(0.0, 0.0, -0.2), 0.0, True),
        (Pose2(), 2.0, True),
        (Pose2(), math.inf, True),
    ],
)
def test_due_after_way_turn_or_time_whichever_comes_first(moved, waited, due) -> None:
    assert SPACING.due(moved, waited) is due
