"""Follower: drives a path and looks where it is to look, one held command at a time."""

from __future__ import annotations

import math
from enum import Enum

import numpy as np

from dynslam_env.navigation.guard import guarded, pressed
from dynslam_env.navigation.pursuit import Command, PathProgress, arc_to
from dynslam_env.navigation.site import PatrolView
from slam.geometry import Array, Pose2

NEAREST = 0.4  # m, lookahead at a standstill; it grows with the speed
AHEAD = 0.5  # s, by which it grows
REACH = 0.15  # m, so near the end counts as there
FACED = math.radians(12)  # so well a heading is taken
SLOWEST = 0.25  # m/s, beside an obstacle and at the end
CLEAR = 0.6  # m, of clearance from which on the robot drives at full speed
BRAKING = 0.6  # share of the deceleration that is counted on
TURNING = 0.8  # share of the largest omega that arcs are driven with
BACK = Command(-0.25, 0.0)  # away from what the robot touches, or nearly
CREEP = 0.02  # m/s, less is standing before something


class State(Enum):
    """What a follower is about."""

    STANDING = "it is to stand still"
    TURNING = "it turns on the spot"
    DRIVING = "it drives, or would if nothing stood in the way"


class Follower:
    """Pure pursuit that slows down in arcs, in narrow places, at the end, and before echoes.

    site   the environment; of it the SLAM's pose and the last scan are used
    state  what the last command was for
    """

    def __init__(self, site: PatrolView):
        self._site = site
        self._way: PathProgress | None = None
        self._heading: float | None = None
        self._clearance = np.empty(0)
        self._v = 0.0
        self.state = State.STANDING

    def follow(self, points: Array, heading: float | None, clearance: Array) -> None:
        """Take the path (n, 2) m from now on, and turn to `heading`, rad, at its end (None: as it
        is); `clearance` (n,) m is that of the costmap along the path."""
        self._way, self._heading, self._clearance = PathProgress(points), heading, clearance

    def halt(self) -> None:
        """Stand still from now on."""
        self._way = None

    @property
    def driven(self) -> float:
        """m of the path that lie behind; 0 without one."""
        return self._way.at if self._way is not None else 0.0

    @property
    def arrived(self) -> bool:
        """At the end of the path, looking where it was to look."""
        if self._way is None or not self._at_end(self._way):
            return False
        return self._heading is None or abs(self._aside(self._heading)) < FACED

    def command(self) -> Command:
        """What to hold for the next period, m/s and rad/s."""
        wanted = self._wanted()
        self.state = _state(wanted)
        robot, period = self._site.robot, self._site.period
        command = guarded(wanted, self._site.scan, robot, period)
        turning = self.state is State.TURNING
        if not turning and pressed(self._site.scan, robot):
            command = BACK
        elif wanted.v > 0.0 and command.v < CREEP and self._way is not None:
            x, y = self._way.carrot(self._pose, NEAREST)
            command = self._turn(math.atan2(y - self._pose.y, x - self._pose.x))
        self._v = max(command.v, 0.0)
        return command

    @property
    def _pose(self) -> Pose2:
        return Pose2.of(self._site.slam.pose)

    def _wanted(self) -> Command:
        """What would be driven if nothing unforeseen stood there."""
        if self._way is None or self.arrived:
            return Command(0.0, 0.0)
        if self._at_end(self._way):
            assert self._heading is not None
            return self._turn(self._heading)
        pose, (fastest, turn) = self._pose, self._site.limits
        lookahead = NEAREST + AHEAD * self._v
        carrot = self._way.carrot(pose, lookahead)
        away = max(math.hypot(carrot[0] - pose.x, carrot[1] - pose.y), 0.05)
        v, omega = arc_to(pose, carrot, self._speed(self._way, fastest), away)
        if v == 0.0:
            return self._turn(math.atan2(carrot[1] - pose.y, carrot[0] - pose.x))
        slower = min(1.0, TURNING * turn / max(abs(omega), 1e-9))
        return Command(v * slower, omega * slower)

    def _speed(self, way: PathProgress, fastest: float) -> float:
        """m/s that the clearance along the path and the way left allow."""
        at = int(np.searchsorted(way.along, way.at))
        near = self._clearance[at : at + round(1.0 / 0.1)]
        radius = self._site.robot.radius
        room = float(near.min()) - radius if len(near) else CLEAR
        share = min(max(room / (CLEAR - radius), 0.0), 1.0)
        v = SLOWEST + (fastest - SLOWEST) * share
        braking = math.sqrt(2 * BRAKING * self._site.robot.acceleration * max(way.left, 0.0))
        return min(v, max(braking, SLOWEST))

    def _turn(self, heading: float) -> Command:
        """On the spot, no faster than can be stopped and than a held command does not overshoot."""
        aside, period = self._aside(heading), self._site.period
        stoppable = math.sqrt(self._site.robot.turn_acceleration * abs(aside))
        omega = min(0.7 * abs(aside) / period, stoppable, self._site.limits[1])
        return Command(0.0, math.copysign(omega, aside))

    def _aside(self, heading: float) -> float:
        return math.remainder(heading - self._pose.theta, math.tau)

    def _at_end(self, way: PathProgress) -> bool:
        x, y = way.points[-1]
        if way.left > 2 * REACH:
            return False  # the path only passes by its end here
        return math.hypot(x - self._pose.x, y - self._pose.y) < REACH


def _state(wanted: Command) -> State:
    if wanted.v > 0.0:
        return State.DRIVING
    return State.TURNING if wanted.omega else State.STANDING
