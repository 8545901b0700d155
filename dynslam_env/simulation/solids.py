"""Solids: the sizes, margins and first states of all solids of a world."""

from __future__ import annotations

import math

import numpy as np

from dynslam_env.simulation.bodies import (
    FIXTURE_MARGIN,
    FIXTURES,
    STOP_BIAS,
    bodies_of,
    body_memory,
)
from dynslam_env.simulation.columns import (
    INVERSE_INERTIA,
    INVERSE_MASS,
    MARGIN,
    MAX_ANGLE,
    MAX_MOTOR,
    MAX_PULL,
    MAX_TURN,
    MIN_ANGLE,
    RADIUS,
    SIDE,
    WIDTH,
)
from dynslam_env.simulation.doors import Doors
from dynslam_env.simulation.index_boxes import sort_in
from dynslam_env.simulation.people import People
from dynslam_env.simulation.polygons import regular
from dynslam_env.simulation.robot import Robot
from dynslam_env.worlds.layout import LEAF_CORNERS, Door, Layout
from slam.errors import InputError
from slam.geometry import Array

MAX_PENETRATION = 0.009  # m, of two solids in the physics step before the contact is resolved
MAX_TIP_SPEED = 3.0  # m/s, of a leaf: a faster one would need a thick margin
PERSON_CORNERS = 8
LEFT_PER_SECOND = math.pow(0.8999999761581421, 60.0)  # of an overshoot, by Chipmunk's joints
NO_CORNERS = np.empty((0, 2))
ROBOT_COLUMNS = [INVERSE_MASS, INVERSE_INERTIA, MAX_PULL, MAX_TURN, RADIUS]
LEAF_COLUMNS = [INVERSE_INERTIA, MIN_ANGLE, MAX_ANGLE, MAX_MOTOR, WIDTH, SIDE, MARGIN]
PERSON_COLUMNS = [INVERSE_MASS, MAX_PULL, RADIUS]
SPARE_ROWS = 3  # Chipmunk adds what stands; it never fills all rows, else it would reallocate them


class Solids:
    """All solids of a world.

    Solids have a margin, thicker the faster they are, in which they touch already; the laser does
    not see it. Within a physics step of `dt` s none gets further into another than MAX_PENETRATION.

    layout   walls and doors
    robot, doors, people  their sizes and forces
    hung     the doors whose leaves move
    immovable  the other doors
    person   (8, 2) m, corners of a person; (0, 2) without people
    memory   what moves; `bodies` are views of it
    first_rows  its rows at the beginning
    """

    def __init__(
        self, layout: Layout, robot: Robot, doors: Doors, people: People, places: Array,
        leaves: Array, dt: float,
    ):  # fmt: skip
        """`places` (p, 2) m of the people; `leaves` (d, 3) x, y, angle, m, m, rad."""
        self.layout, self.robot, self.doors, self.people = layout, robot, doors, people
        self._dt = dt
        self.hung, self.immovable = (() if doors.fixed else layout.doors), layout.doors
        if self.hung:
            self.immovable = ()
        self.leaves = leaves
        self.person: Array = NO_CORNERS
        if len(places):
            self.person = regular(people.radius, PERSON_CORNERS)
        self.margin = self._margin(0.0)
        self.memory = self._memory(places)
        self.bodies = bodies_of(self.memory)
        self.first_rows = self.bodies.rows.copy()

    def leaf_margin(self, door: Door) -> float:
        """Margin of a door's leaf, m."""
        return self._margin(0.0 if self.doors.fixed else _tip_speed(door, self.doors))

    @property
    def person_margin(self) -> float:
        """Margin of a person, m."""
        return self._margin(self.people.speed)

    @property
    def robot_inertia(self) -> float:
        """Of a disc, kg m^2."""
        return self.robot.mass * (0.5 * self.robot.radius**2)

    def stops(self, door: Door) -> tuple[float, float]:
        """The smallest and the largest angle of a leaf, rad."""
        turn = 0.0 if door.slides else door.swing * self.doors.open_angle
        angles = door.closed, door.closed + turn
        return min(angles), max(angles)

    def _margin(self, speed: float) -> float:
        return max((self.robot.max_speed + speed) * self._dt - MAX_PENETRATION, 0.0)

    def _memory(self, places: Array) -> Array:
        """The bodies at their first places."""
        d, p = len(self.hung), len(places)
        memory = body_memory(d, p, len(self.immovable) + SPARE_ROWS)
        rows, table = (bodies := bodies_of(memory)).rows, bodies.parts
        wheels = 1 + d + p
        rows[0, :3] = rows[wheels, :3] = self.layout.start
        rows[1 : 1 + d, :3] = self.leaves[:d]
        rows[1 + d : wheels, :2] = rows[wheels + 1 : wheels + 1 + p, :2] = places
        table[0, ROBOT_COLUMNS] = self._robot_part()
        if d:
            table[1 : 1 + d, LEAF_COLUMNS] = [self._leaf_part(door) for door in self.hung]
        if p:
            table[1 + d :, PERSON_COLUMNS] = self._person_part()
        fixed = len(self.layout.walls) + LEAF_CORNERS * len(self.immovable)
        memory[FIXTURES], memory[FIXTURE_MARGIN] = fixed, self._margin(0.0)
        memory[STOP_BIAS] = 1.0 - math.pow(LEFT_PER_SECOND, self._dt)
        sort_in(rows, rows, table, d, bodies.boxes)
        return memory

    def _robot_part(self) -> tuple[float, ...]:
        robot = self.robot
        turn = robot.traction * robot.wheel_base / 2 * self._dt
        return (
            1.0 / robot.mass, 1.0 / self.robot_inertia, robot.traction * self._dt, turn,
            robot.radius,
        )  # fmt: skip

    def _leaf_part(self, door: Door) -> tuple[float, ...]:
        return (
            1.0 / self.doors.inertia(door), *self.stops(door), self.doors.torque * self._dt,
            door.width, -door.swing * door.thickness, self.leaf_margin(door),
        )  # fmt: skip

    def _person_part(self) -> tuple[float, ...]:
        people = self.people
        return 1.0 / people.mass, people.force * self._dt, people.radius + self.person_margin


def _tip_speed(door: Door, doors: Doors) -> float:
    """Speed of a leaf's free edge at full speed, m/s; raises InputError beyond MAX_TIP_SPEED."""
    speed = door.width / doors.swing_time if door.slides else doors.speed * door.width
    if speed > MAX_TIP_SPEED:
        raise InputError(
            f"a leaf {door.width:g} m wide cannot open in Doors.swing_time = "
            f"{doors.swing_time:g} s: its edge may move at {MAX_TIP_SPEED:g} m/s at most"
        )
    return speed
