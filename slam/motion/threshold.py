"""Motion threshold: the distance, turn or time between two keyframes."""

from __future__ import annotations

import math
from dataclasses import dataclass

from slam.errors import InputError
from slam.geometry import Pose2


@dataclass(frozen=True)
class MotionThreshold:
    """The next event is due after a distance, a turn or a time, whichever comes first.

    distance  m; infinity: never
    turn      rad; likewise
    time      s; likewise
    """

    distance: float
    turn: float
    time: float

    def __post_init__(self) -> None:
        if not min(self.distance, self.turn, self.time) >= 0:
            raise InputError(f"a spacing has no part below 0 (infinity is never), got {self}")

    def due(self, moved: Pose2, waited: float) -> bool:
        """Whether the next event is due, having `moved` and `waited` (s) since the last one."""
        return (
            math.hypot(moved.x, moved.y) >= self.distance
            or abs(moved.theta) >= self.turn
            or waited >= self.time
        )


KEYFRAMES = MotionThreshold(distance=0.1, turn=math.radians(10.0), time=2.0)
