"""Follower: follows a path by pure pursuit, then turns to a heading."""

from __future__ import annotations

import math
from enum import Enum

import numpy as np

from dynslam_env.navigation.guard import contact_ahead, guarded
from dynslam_env.navigation.patrol_snapshot import PatrolSnapshot
from dynslam_env.navigation.pursuit import Command, PathProgress, arc_to
from slam.geometry import Array, Pose2

MIN_LOOKAHEAD = 0.4  # m, at a standstill
LOOKAHEAD_TIME = 0.5  # s: the lookahead grows by this times the speed
GOAL_TOLERANCE = 0.15  # m, from the end of the path
HEADING_TOLERANCE = math.radians(12)
MIN_SPEED = 0.25  # m/s, beside an obstacle and at the end
FULL_SPEED_CLEARANCE = 0.6  # m, of clearance from which on the robot drives at full speed
BRAKING_SHARE = 0.6  # of the robot's deceleration, assumed for braking
TURN_SHARE = 0.8  # of the largest omega, for arcs
BACK_OFF = Command(-0.25, 0.0)  # reverse from a contact ahead
MIN_PROGRESS = 0.02  # m/s; slower than this, the robot counts as blocked
CLEARANCE_CELLS = 10  # of the path, 0.1 m each, whose clearance limits the speed


class State(Enum):
    """The purpose of a follower's last command."""

    STANDING = "stand still"
    TURNING = "turn on the spot"
    DRIVING = "drive, even where an obstacle prevents it"


class Follower:
    """Pure pursuit that slows down in arcs, in narrow places, at the end, and before echoes.

    state  purpose of the last command
    """

    def __init__(self) -> None:
        self._path: PathProgress | None = None
        self._heading: float | None = None
        self._clearance = np.empty(0)
        self._v = 0.0
        self.state = State.STANDING

    def follow(self, points: Array, heading: float | None, clearance: Array) -> None:
        """Follow the path `points` (n, 2), m, then turn to `heading`, rad (None: do not turn).

        clearance  (n,) m, of the costmap along the path
        """
        self._path, self._heading, self._clearance = PathProgress(points), heading, clearance

    def halt(self) -> None:
        """Drop the path and stand still."""
        self._path = None

    @property
    def travelled(self) -> float:
        """m of the path that lie behind the robot; 0 without a path."""
        return self._path.travelled if self._path is not None else 0.0

    def arrived(self, pose: Pose2) -> bool:
        """Whether `pose` is at the end of the path and has the heading."""
        if self._path is None or not _at_end(self._path, pose):
            return False
        return self._heading is None or abs(_offset(self._heading, pose)) < HEADING_TOLERANCE

    def command(self, snapshot: PatrolSnapshot) -> Command:
        """The command to hold for the next period, m/s and rad/s."""
        wanted, pose = self._wanted(snapshot), snapshot.pose
        self.state = _state(wanted)
        command = guarded(wanted, snapshot.scan, snapshot.robot, snapshot.period)
        turning = self.state is State.TURNING
        if not turning and contact_ahead(snapshot.scan, snapshot.robot):
            command = BACK_OFF
        elif wanted.v > 0.0 and command.v < MIN_PROGRESS and self._path is not None:
            x, y = self._path.lookahead_point(pose, MIN_LOOKAHEAD)
            command = _turn(math.atan2(y - pose.y, x - pose.x), snapshot)
        self._v = max(command.v, 0.0)
        return command

    def _wanted(self, snapshot: PatrolSnapshot) -> Command:
        """The command if there were no unmapped obstacle."""
        pose, (max_speed, max_turn) = snapshot.pose, snapshot.limits
        if self._path is None or self.arrived(pose):
            return Command(0.0, 0.0)
        if _at_end(self._path, pose):
            assert self._heading is not None
            return _turn(self._heading, snapshot)
        x, y = self._path.lookahead_point(pose, MIN_LOOKAHEAD + LOOKAHEAD_TIME * self._v)
        distance = max(math.hypot(x - pose.x, y - pose.y), 0.05)
        v, omega = arc_to(pose, (x, y), self._speed(self._path, max_speed, snapshot), distance)
        if v == 0.0:
            return _turn(math.atan2(y - pose.y, x - pose.x), snapshot)
        factor = min(1.0, TURN_SHARE * max_turn / max(abs(omega), 1e-9))
        return Command(v * factor, omega * factor)

    def _speed(self, path: PathProgress, max_speed: float, snapshot: PatrolSnapshot) -> float:
        """m/s that the clearance along the path and the remaining length allow."""
        robot = snapshot.robot
        first = int(np.searchsorted(path.distances, path.travelled))
        near = self._clearance[first : first + CLEARANCE_CELLS]
        room = float(near.min()) - robot.radius if len(near) else FULL_SPEED_CLEARANCE
        share = min(max(room / (FULL_SPEED_CLEARANCE - robot.radius), 0.0), 1.0)
        v = MIN_SPEED + (max_speed - MIN_SPEED) * share
        braking = math.sqrt(2 * BRAKING_SHARE * robot.acceleration * max(path.remaining, 0.0))
        return min(v, max(braking, MIN_SPEED))


def _turn(heading: float, snapshot: PatrolSnapshot) -> Command:
    """Turn on the spot, no faster than the robot can stop and without overshoot in one period."""
    offset = _offset(heading, snapshot.pose)
    stoppable = math.sqrt(snapshot.robot.turn_acceleration * abs(offset))
    omega = min(0.7 * abs(offset) / snapshot.period, stoppable, snapshot.limits[1])
    return Command(0.0, math.copysign(omega, offset))


def _offset(heading: float, pose: Pose2) -> float:
    """rad from the robot's heading to `heading`, wrapped."""
    return math.remainder(heading - pose.theta, math.tau)


def _at_end(path: PathProgress, pose: Pose2) -> bool:
    x, y = path.points[-1]
    if path.remaining > 2 * GOAL_TOLERANCE:
        return False  # the path passes near its own end
    return math.hypot(x - pose.x, y - pose.y) < GOAL_TOLERANCE


def _state(wanted: Command) -> State:
    if wanted.v > 0.0:
        return State.DRIVING
    return State.TURNING if wanted.omega else State.STANDING
