"""When a SLAM matches or maps the next scan: after a given distance, turn or time."""

from __future__ import annotations

import math
from dataclasses import dataclass

from slam.bounds import MAX_COORDINATE, all_within
from slam.errors import InputError
from slam.geometry import Pose2


@dataclass(frozen=True)
class MotionThreshold:
    """Spacing of two events by distance, turn or time, whichever comes first.

    distance m; turn rad; time s; infinity: never for that reason
    """

    distance: float
    turn: float
    time: float

    def __post_init__(self) -> None:
        if not min(self.distance, self.turn, self.time) >= 0:
            raise InputError(f"a threshold has no part below 0 (infinity is never), got {self}")

    def due(self, displacement: Pose2, waited: float) -> bool:
        """Whether the next event is due, `displacement` and `waited` s after the last one."""
        return (
            math.hypot(displacement.x, displacement.y) >= self.distance
            or abs(displacement.theta) >= self.turn
            or waited >= self.time
        )


class MotionTrigger:
    """The motion since the last event, such as a keyframe, and whether the next one is due.

    displacement  since the last event, in the robot's frame of then
    time          s, of the last event; -inf before the first, which is always due
    """

    def __init__(self, threshold: MotionThreshold):
        self.threshold = threshold
        self.displacement = self._origin = Pose2()
        self.time = -math.inf

    def move(self, displacement: Pose2) -> None:
        """Add a displacement in the robot's frame. Raises InputError for one that no robot makes;
        every SLAM calls this before it computes anything with it."""
        if not all_within(displacement, MAX_COORDINATE):
            raise InputError(
                f"a displacement has finite numbers up to {MAX_COORDINATE:g} m or rad, "
                f"got {tuple(displacement)}"
            )
        self.displacement = self.displacement @ displacement

    def move_to(self, pose: Pose2) -> None:
        """The robot is at `pose` now, in the frame of the pose given to `restart`."""
        self.displacement = self._origin.between(pose)

    def due(self, time: float) -> bool:
        """Whether the next event is due at `time`, s."""
        return self.threshold.due(self.displacement, time - self.time)

    def restart(self, time: float, pose: Pose2 = Pose2()) -> None:
        """The event takes place, at `time`, s; `pose` is where `move_to` counts from."""
        self.displacement, self._origin, self.time = Pose2(), pose, time


KEYFRAMES = MotionThreshold(distance=0.1, turn=math.radians(10.0), time=2.0)
