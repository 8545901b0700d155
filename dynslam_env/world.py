"""The physics: robot, walls and hinged doors in pymunk. The only file that imports pymunk."""

from __future__ import annotations

import math

import numpy as np
import pymunk
from pymunk.constraints import GearJoint, PivotJoint, RotaryLimitJoint, SimpleMotor

from dynslam_env.doors import Doors, Leaves, schedule
from dynslam_env.layout import Door, Layout
from dynslam_env.robot import Robot
from slam.geometry import Array, Pose2

CONTROL_DT = 0.1  # s, one step of the environment
SUBSTEPS = 10  # physics steps in it
PHYSICS_DT = CONTROL_DT / SUBSTEPS
FIXED, LEAF, ROBOT = 1, 2, 4  # kinds of shapes, as bits
SKIN = 0.003  # m around walls and leaves: what the robot dents in one physics step stays outside
HEAVY = 1e30  # kg: a leaf turns, and its hinge never moves, with no joint that could give way


class World:
    """One episode's world. A new episode builds a new one.

    The robot is driven as a body that wheels pull along: a kinematic body with the commanded
    velocity drags it by two joints of limited force (setting the robot's own velocity would press
    it into walls). Within a control step its velocity keeps one direction, the arc's chord, while
    the robot turns. pymunk moves bodies before it solves for their velocities: what is asked for
    takes hold one physics step later.
    """

    def __init__(self, layout: Layout, robot: Robot, doors: Doors, rng: np.random.Generator):
        self.robot, self.doors, self.steps = robot, doors, 0
        self._space = pymunk.Space()
        self._space.collision_slop = 0.0005  # m; pymunk's default is meant for pixels
        is_open = rng.random(len(layout.doors)) < doors.open_share
        self._schedule = schedule(doors, len(layout.doors), rng)
        self._add_walls(layout.walls)
        self._moving: list[Hinged] = []
        self._bodies = [
            self._add_door(d, bool(o)) for d, o in zip(layout.doors, is_open, strict=True)
        ]
        self._body, self._wheels = self._add_robot(layout.start)
        self._watch_contacts()
        self._closed = np.array([door.closed for door in layout.doors])
        self._swing = np.array([door.swing for door in layout.doors])
        self._segments = np.empty((len(layout.walls) + 4 * len(layout.doors), 4))
        self._segments[: len(layout.walls)] = layout.walls
        self._leaves, self._first_leaf = Leaves(layout.doors), len(layout.walls)
        self._velocity = 0.0, 0.0
        self._read()

    # -- state ---------------------------------------------------------------------------------

    pose: Pose2
    """The robot in the world."""

    collided: bool = False
    """The robot touched a wall or a door during the last step."""

    @property
    def time(self) -> float:
        """s since the beginning."""
        return self.steps * CONTROL_DT

    @property
    def velocity(self) -> tuple[float, float]:
        """Forward and turning velocity in the last step, m/s and rad/s."""
        return self._velocity

    @property
    def door_angles(self) -> Array:
        """(d,) rad, 0 closed, positive open."""
        return (np.array(self._angles) - self._closed) * self._swing

    @property
    def segments(self) -> Array:
        """(w + 4 d, 4) walls, then the edges of the leaves as they stand now; a view."""
        return self._segments

    # -- one control step ----------------------------------------------------------------------

    def step(self, v: float, omega: float) -> None:
        """Ask the wheels for `v` m/s and `omega` rad/s, and let CONTROL_DT seconds pass."""
        v, omega = self.robot.accelerated(self._velocity, (v, omega), CONTROL_DT)
        half = omega * CONTROL_DT / 2
        heading = self.pose.theta + self._velocity[1] * PHYSICS_DT + half  # in mid-arc
        chord = math.sin(half) / half if half else 1.0
        dx, dy = math.cos(heading) * chord, math.sin(heading) * chord
        self._wheels.velocity = v * dx, v * dy
        self._wheels.angular_velocity = omega
        self._move_doors()
        self._touched = self._contacts > 0
        for _ in range(SUBSTEPS):
            self._space.step(PHYSICS_DT)
        self.steps += 1
        self.collided = self._touched
        vx, vy = self._body.velocity
        self._velocity = (vx * dx + vy * dy) / chord**2, self._body.angular_velocity
        self._read()

    def _read(self) -> None:
        x, y = self._body.position
        self.pose = Pose2(x, y, math.remainder(self._body.angle, math.tau))
        self._angles = [body.angle for body in self._bodies]
        self._leaves.outline(self._angles, self._segments[self._first_leaf :])

    def _move_doors(self) -> None:
        for flipped in self._schedule.due(self.time):
            self._moving[flipped].flip()
        for door, angle in zip(self._moving, self._angles, strict=False):
            door.drive(angle)

    # -- building ------------------------------------------------------------------------------

    def _add_walls(self, walls: Array) -> None:
        static = self._space.static_body
        for x1, y1, x2, y2 in walls.tolist():
            self._add_shape(pymunk.Segment(static, (x1, y1), (x2, y2), SKIN), FIXED)

    def _add_shape(self, shape: pymunk.Shape, kind: int) -> None:
        others = FIXED | LEAF if kind == ROBOT else ROBOT
        shape.filter = pymunk.ShapeFilter(categories=kind, mask=others)
        shape.collision_type, shape.friction = kind, 0.2
        self._space.add(shape)

    def _add_robot(self, start: Pose2) -> tuple[pymunk.Body, pymunk.Body]:
        robot, space = self.robot, self._space
        moment = pymunk.moment_for_circle(robot.mass, 0, robot.radius)
        body, wheels = pymunk.Body(robot.mass, moment), pymunk.Body(body_type=pymunk.Body.KINEMATIC)
        for each in (body, wheels):
            each.position, each.angle = (start.x, start.y), start.theta
        pull = PivotJoint(wheels, body, (0, 0), (0, 0))
        turn = GearJoint(wheels, body, 0.0, 1.0)
        pull.max_bias = turn.max_bias = 0.0  # match velocities only: never pull back into a wall
        pull.max_force = robot.traction
        turn.max_force = robot.traction * robot.wheel_base / 2
        space.add(body, wheels, pull, turn)
        self._add_shape(pymunk.Circle(body, robot.radius), ROBOT)
        return body, wheels

    def _add_door(self, door: Door, is_open: bool) -> pymunk.Body:
        if self.doors.law == "static":
            body = pymunk.Body(body_type=pymunk.Body.STATIC)
            body.position = door.hinge
            body.angle = door.closed + door.swing * self.doors.open_angle * is_open
            self._space.add(body)
        else:
            hinged = Hinged(door, self.doors, self._space.static_body, is_open)
            self._moving.append(hinged)
            self._space.add(*hinged.parts)
            body = hinged.body
        self._add_shape(pymunk.Poly(body, door.corners.tolist(), radius=SKIN), LEAF)
        return body

    def _watch_contacts(self) -> None:
        self._contacts, self._touched = 0, False

        def begin(*_: object) -> None:
            self._contacts += 1
            self._touched = True

        def separate(*_: object) -> None:
            self._contacts -= 1

        for kind in (FIXED, LEAF):
            self._space.on_collision(ROBOT, kind, begin=begin, separate=separate)


class Hinged:
    """A door's body with its motor."""

    def __init__(self, door: Door, doors: Doors, frame: pymunk.Body, is_open: bool):
        inertia = doors.mass * door.width**2 / 3  # of a thin plate about its edge
        opening = door.swing * doors.open_angle
        self._angles = door.closed, door.closed + opening
        self._open = is_open
        self._speed = doors.open_angle / doors.swing_time
        self._braking = 0.75 * doors.torque / inertia  # rad/s^2, some of the torque is kept back
        self._rate = 0.0
        self.body = pymunk.Body(HEAVY, inertia)
        self.body.position, self.body.angle = door.hinge, self._angles[is_open]
        self._motor = SimpleMotor(self.body, frame, 0.0)
        self._motor.max_force = doors.torque
        stops = RotaryLimitJoint(frame, self.body, *sorted(self._angles))
        self.parts = self.body, self._motor, stops

    def flip(self) -> None:
        """Close an open door, open a closed one."""
        self._open = not self._open

    def drive(self, angle: float) -> None:
        """Set the motor's rate for the next control step: fast, then braking to stand still."""
        error = self._angles[self._open] - angle
        far = abs(error)
        if far < 1e-6:
            rate = 0.0
        else:
            rate = min(self._speed, math.sqrt(2 * self._braking * far), far / CONTROL_DT)
            rate = math.copysign(rate, error)
        if rate != self._rate:
            self._motor.rate = self._rate = rate
