"""Guard: the speed at which the last scan allows the robot to drive an arc."""

from __future__ import annotations

import math

import numpy as np

from dynslam_env.navigation.pursuit import Command
from dynslam_env.simulation.robot import Robot
from slam.kernel import kernel
from slam.scan import Scan

ARC_STEP = 0.05  # m, between the poses of an arc that are checked
MAX_FREE_LENGTH = 1.5  # m, of an arc that is checked
CONTACT_GAP = 0.02  # m, between body and echo, that counts as contact
ECHO_MARGIN = 0.03  # m, kept between body and echo


def free_length(
    scan: Scan, curvature: float, radius: float, max_length: float = MAX_FREE_LENGTH
) -> float:
    """m that a disc of `radius` m can move along an arc before it touches an echo, at most
    `max_length`.

    An echo that the disc touches at the start does not count while the arc leads away from it.

    curvature  1/m, positive to the left
    """
    return _free_length(scan.points, curvature, radius, max_length)


def guarded(command: Command, scan: Scan, robot: Robot, period: float) -> Command:
    """The command, slowed on its arc such that the robot can still stop after holding it.

    period  s, that the command is held
    """
    v, omega = command
    if v <= 0.0:
        return command  # the laser does not see behind the robot
    clear = free_length(scan, omega / v, robot.radius + ECHO_MARGIN)
    a = robot.acceleration
    max_v = a * (math.sqrt(period**2 + 2 * clear / a) - period)  # v T + v^2 / 2 a = clear
    if v <= max_v:
        return command
    return Command(max_v, omega * max_v / v)


def contact_ahead(scan: Scan, robot: Robot) -> bool:
    """Whether an echo ahead is within CONTACT_GAP of the body, as of a leaf that swings
    against it."""
    points = scan.points[scan.points[:, 0] > robot.radius / 2]
    return bool((np.hypot(*points.T) < robot.radius + CONTACT_GAP).any())


@kernel
def _free_length(points, curvature, radius, max_length):
    steps = int(np.ceil(max_length / ARC_STEP))
    first = np.empty(len(points))
    for p in range(len(points)):
        first[p] = math.sqrt(points[p, 0] ** 2 + points[p, 1] ** 2)
    for k in range(1, steps + 1):
        s = min(k * ARC_STEP, max_length)
        turn = curvature * s
        if abs(turn) < 1e-6:
            x, y = s, 0.0
        else:
            x, y = math.sin(turn) / curvature, (1.0 - math.cos(turn)) / curvature
        for p in range(len(points)):
            dx, dy = points[p, 0] - x, points[p, 1] - y
            away = math.sqrt(dx * dx + dy * dy)
            if away < radius and away < first[p]:
                return s - ARC_STEP
    return max_length
