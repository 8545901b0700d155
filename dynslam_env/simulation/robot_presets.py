"""Robots by name, with the place of their laser, as in `robot="TurtleBot3"`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

from dynslam_env.sensors.laser import Laser
from dynslam_env.sensors.laser_presets import laser_named
from dynslam_env.simulation.robot import Robot
from slam.geometry import Pose2
from slam.validation import one_of


class EquippedRobot(NamedTuple):
    """A robot, and the pose of the laser that it carries (robot_from_sensor)."""

    robot: Robot
    mount: Pose2


PIONEER_3DX = EquippedRobot(Robot(radius=0.25), Pose2(0.018, 0.0, 0.0))
"""Pioneer 3-DX. ARIA's p3dx.p: RobotRadius 250, LaserX 18 (mm); all else as `Robot()`, whose radius
of 220 mm and laser at the centre are those of the paper's experiment."""

TURTLEBOT3 = EquippedRobot(
    Robot(radius=0.105, mass=1.0, wheel_base=0.16, max_speed=0.22, max_turn=2.84,
          acceleration=2.0, turn_acceleration=2.0, traction=5.0),
    Pose2(-0.032, 0.0, 0.0),
)  # fmt: skip
"""TurtleBot3 Burger. Robotis' e-manual: 0.22 m/s, 2.84 rad/s, 1 kg, 160 mm between the wheels; its
navigation parameters: radius 0.105 m, accelerations of 2 m/s^2 and 2 rad/s^2; its URDF: laser 32 mm
behind the axle. Ours: the traction of 5 N, half the weight."""

ROBOTS: Mapping[str, EquippedRobot] = {"Pioneer-3DX": PIONEER_3DX, "TurtleBot3": TURTLEBOT3}
"""Robots by name."""


def equipped(robot: object, laser: object) -> dict[str, Any]:
    """The keywords `robot` and `laser` where names stand for presets; others are left out.

    A robot that is named carries the laser at its own place, unless the laser has another mount
    than the robot's centre. Raises InputError for an unknown name.
    """
    made: dict[str, Any] = {}
    if isinstance(laser, str):
        laser = made["laser"] = laser_named(laser)
    if isinstance(robot, str):
        one_of("robot", robot, tuple(ROBOTS))
        made["robot"] = ROBOTS[robot].robot
        carried = Laser() if laser is None else laser
        if isinstance(carried, Laser) and carried.mount == Pose2():
            made["laser"] = replace(carried, mount=ROBOTS[robot].mount)
    return made
