"""Guard: how fast a robot may drive an arc, given what the last scan sees."""

from __future__ import annotations

import math

import numpy as np

from dynslam_env.navigation.pursuit import Command
from dynslam_env.simulation.robot import Robot
from slam.kernel import kernel
from slam.scan import Scan

STEP = 0.05  # m, along the arc
REACH = 1.5  # m, looked ahead
TOUCH = 0.02  # m, between body and echo
MARGIN = 0.03  # m, kept between the body and an echo


def free_length(scan: Scan, curvature: float, radius: float, reach: float = REACH) -> float:
    """m that a disc of `radius` m can go along an arc before it touches an echo; at most `reach`.

    What touches it already does not count as long as the arc leads away from it.

    curvature  1/m, positive to the left
    """
    return _free_length(scan.points, curvature, radius, reach)


def guarded(command: Command, scan: Scan, robot: Robot, period: float) -> Command:
    """The command, slowed on its arc such that the robot can still stop after holding it.

    period  s, that the command is held
    """
    v, omega = command
    if v <= 0.0:
        return command  # the laser does not see what is behind
    clear = free_length(scan, omega / v, robot.radius + MARGIN)
    a = robot.acceleration
    fastest = a * (math.sqrt(period**2 + 2 * clear / a) - period)  # v T + v^2 / 2 a = clear
    if v <= fastest:
        return command
    return Command(fastest, omega * fastest / v)


def pressed(scan: Scan, robot: Robot) -> bool:
    """Whether something ahead all but touches the robot, as a leaf that swings against it."""
    points = scan.points[scan.points[:, 0] > robot.radius / 2]
    return bool((np.hypot(*points.T) < robot.radius + TOUCH).any())


@kernel
def _free_length(points, curvature, radius, reach):
    steps = int(np.ceil(reach / STEP))
    first = np.empty(len(points))
    for p in range(len(points)):
        first[p] = math.sqrt(points[p, 0] ** 2 + points[p, 1] ** 2)
    for k in range(1, steps + 1):
        s = min(k * STEP, reach)
        turn = curvature * s
        if abs(turn) < 1e-6:
            x, y = s, 0.0
        else:
            x, y = math.sin(turn) / curvature, (1.0 - math.cos(turn)) / curvature
        for p in range(len(points)):
            dx, dy = points[p, 0] - x, points[p, 1] - y
            away = math.sqrt(dx * dx + dy * dy)
            if away < radius and away < first[p]:
                return s - STEP
    return reach
