"""Spacing: how far apart along the way a SLAM does things."""

from __future__ import annotations

import math
from dataclasses import dataclass

from slam.errors import InputError
from slam.geometry import Pose2


@dataclass(frozen=True)
class MotionThreshold:
    """How far apart two events are: after so much way, turn or time, whichever comes first.

    distance m; turn rad; time s; infinity: it never asks
    """

    distance: float
    turn: float
    time: float

    def __post_init__(self) -> None:
        if not min(self.distance, self.turn, self.time) >= 0:
            raise InputError(f"a spacing has no part below 0 (infinity is never), got {self}")

    def due(self, moved: Pose2, waited: float) -> bool:
        """Whether having `moved` or `waited` (s) since the last one asks for the next."""
        return (
            math.hypot(moved.x, moved.y) >= self.distance
            or abs(moved.theta) >= self.turn
            or waited >= self.time
        )


KEYFRAMES = MotionThreshold(distance=0.1, turn=math.radians(10.0), time=2.0)
