import math

import numpy as np
import pytest

from slam.geometry import Pose2
from slam.motion.threshold import MotionThreshold, MotionTrigger

THRESHOLD = MotionThreshold(distance=0.5, turn=0.2, time=2.0)


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
    assert THRESHOLD.due(moved, waited) is due


def test_what_never_happened_is_due() -> None:
    assert MotionTrigger(THRESHOLD).due(-1e12)


def test_the_trigger_adds_displacements_up_and_begins_anew() -> None:
    since = MotionTrigger(THRESHOLD)
    since.restart(10.0)
    assert not since.due(11.9)
    assert since.due(12.0)
    for _ in range(3):
        since.move(Pose2(0.2, 0.0, 0.0))
    assert since.due(10.0)
    assert since.displacement.x == pytest.approx(0.6)
    since.restart(10.5)
    assert since.displacement == Pose2()
    assert since.time == 10.5
    assert not since.due(10.5)


def test_the_trigger_measures_from_where_the_last_event_was() -> None:
    since = MotionTrigger(THRESHOLD)
    here = Pose2(3.0, 4.0, math.pi / 2)
    since.restart(0.0, here)
    since.move_to(Pose2(3.0, 4.4, math.pi / 2))
    assert not since.due(0.0)
    since.move_to(Pose2(3.0, 4.5, math.pi / 2))
    assert since.due(0.0)
    np.testing.assert_allclose(since.displacement, (0.5, 0.0, 0.0), atol=1e-12)
