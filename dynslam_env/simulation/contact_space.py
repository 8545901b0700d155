"""ContactSpace: all solids of a world in a space of Chipmunk, which moves them where some touch."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pymunk
from pymunk._chipmunk_cffi import lib
from pymunk.constraints import Constraint, GearJoint, PivotJoint, RotaryLimitJoint, SimpleMotor

from dynslam_env.simulation.bodies import KEPT
from dynslam_env.simulation.chipmunk import BodyStates, address, impulse_of
from dynslam_env.simulation.contacts import FIXED, KINDS_TOUCHED, LEAF, PERSON, ROBOT, Contacts
from dynslam_env.simulation.pointers import copy_doubles, doubles_of
from dynslam_env.simulation.solids import Solids
from slam.geometry import Array

COLLIDES_WITH = {FIXED: ROBOT | PERSON, LEAF: ROBOT | PERSON, ROBOT: FIXED | LEAF | PERSON,
         PERSON: FIXED | LEAF | ROBOT | PERSON}  # fmt: skip
FILTERS = {
    kind: pymunk.ShapeFilter(categories=kind, mask=mask) for kind, mask in COLLIDES_WITH.items()
}
FRICTION = 0.2  # of all solids
LEAF_MASS = 1e30  # kg: a leaf turns about its hinge, which needs no joint to stay in place
SET_VELOCITY, SET_ANGULAR_VELOCITY = lib.cpBodySetVelocity, lib.cpBodySetAngularVelocity
SET_POSITION, SET_ANGLE = lib.cpBodySetPosition, lib.cpBodySetAngle
SET_RATE = lib.cpSimpleMotorSetRate
TOTAL_IMPULSE = lib.cpArbiterTotalImpulse


class ContactSpace:
    """The solids of a world as bodies of a pymunk space.

    The wheels are a kinematic body with the commanded velocity that pulls the robot by two joints
    of limited force (setting the robot's own velocity would press it into walls). People are driven
    in the same way. pymunk updates positions before velocities: a command takes effect one physics
    step later.

    space     the pymunk space
    states    steps it
    touching  whether anything touched anything in the last `advance`
    """

    def __init__(self, solids: Solids, contacts: Contacts):
        self._bodies, self._first_rows = solids.bodies, solids.first_rows
        self._rows, self._rates = solids.bodies.rows, solids.bodies.rates
        self._first_puller = len(solids.bodies.parts)
        self._contacts, self._others, self._others_touched = contacts, 0, False
        self._rates_set: list[float] = []
        self.space = pymunk.Space()
        self.space.collision_slop = 0.0005  # m; pymunk's default is meant for pixels
        self._pulled: list[tuple[pymunk.Body, pymunk.Body, list[Constraint]]] = []
        self._hung: list[tuple[pymunk.Body, list[Constraint]]] = []
        self._add_walls(solids)
        self._add_robot(solids)
        self._add_doors(solids)
        self._add_people(solids)
        for puller, _, joints in self._pulled:
            self.space.add(puller, *joints)
        self._count_contacts()
        self.states = BodyStates(self.space, self._rows)
        self._in_order = self._ordered()
        shapes = [address(shape._shape) for shape in self._moving_shapes()]
        self._shapes = np.array(shapes, dtype=np.uintp)
        pairs = self._impulses_in_memory(solids.bodies.impulses)
        there, here = zip(*pairs, strict=True)
        self._impulses_there, self._impulses_here = doubles_of(there), doubles_of(here)
        self._check_order()

    @property
    def touching(self) -> bool:
        """Whether anything touched anything in the last `advance`."""
        return self._contacts.any or self._others_touched

    def enter(self, dt: float) -> None:
        """Begin with the present states, after physics steps of `dt` s elsewhere."""
        self.catch_up(dt)
        if self._bodies.last.any():
            self.states.place_at(self._bodies.last, len(self._in_order), dt)
            self._bodies.last[:] = 0.0
        self.place()
        copy_doubles(self._impulses_here, self._impulses_there)

    def catch_up(self, dt: float) -> None:
        """Sort the bodies in as they would be by the steps that were made elsewhere."""
        self.states.sort_in(self._bodies, self._shapes, len(self._in_order), dt)
        self._bodies.numbers[KEPT] = 0

    def place(self) -> None:
        """Put all bodies where their rows are."""
        self.states.place()

    def _place_each(self) -> None:
        """The same, one by one."""
        for row, body in zip(self._rows.tolist(), self._in_order, strict=False):
            SET_POSITION(body, row[:2])
            SET_ANGLE(body, row[2])
            SET_VELOCITY(body, row[3:5])
            SET_ANGULAR_VELOCITY(body, row[5])

    def _ordered(self) -> list[Any]:
        """Chipmunk's bodies, in the order of the rows."""
        (wheels, robot, _), *people = self._pulled
        moving = [robot, *(leaf for leaf, _ in self._hung), *(body for _, body, _ in people)]
        return [each._body for each in (*moving, wheels, *(feet for feet, _, _ in people))]

    def _moving_shapes(self) -> list[pymunk.Shape]:
        (_, robot, _), *people = self._pulled
        bodies = [robot, *(leaf for leaf, _ in self._hung), *(body for _, body, _ in people)]
        return [next(iter(body.shapes)) for body in bodies]

    def _impulses_in_memory(self, impulses: Array) -> list[tuple[Array, Array]]:
        """Of each joint: where Chipmunk keeps its impulse, and where `Bodies` does."""
        (_, _, (pull, turn)), *people = self._pulled
        pairs = [(pull, impulses[0, :2]), (turn, impulses[0, 2:])]
        for (_, joints), row in zip(self._hung, impulses[1:], strict=False):
            pairs += [(joint, row[k : k + 1]) for k, joint in enumerate(joints)]
        of_people = impulses[1 + len(self._hung) :]
        pairs += [(pull, row[:2]) for (_, _, (pull,)), row in zip(people, of_people, strict=True)]
        return [(impulse_of(joint), kept) for joint, kept in pairs]

    def advance(self, steps: int, dt: float) -> None:
        """Move the bodies by `steps` physics steps of `dt` s."""
        self._others_touched = self._others > 0
        self.place()  # with the velocities of what pulls, and of leaves that slide
        if (rates := self._rates.tolist()) != self._rates_set:
            self._rates_set = rates
            for rate, (_, joints) in zip(rates, self._hung, strict=False):
                if joints:
                    SET_RATE(joints[0]._constraint, rate)
        self.states.advance_sorted(steps, dt, self._bodies, len(self._hung))
        copy_doubles(self._impulses_there, self._impulses_here)

    # -- building ------------------------------------------------------------------------------

    def _add_walls(self, solids: Solids) -> None:
        static = self.space.static_body
        for x1, y1, x2, y2 in solids.layout.walls.tolist():
            wall = pymunk.Segment(static, (x1, y1), (x2, y2), solids.margin)
            self._add_shape(wall, FIXED)

    def _add_shape(self, shape: pymunk.Shape, kind: int) -> None:
        shape.filter = FILTERS[kind]
        shape.collision_type, shape.friction = kind, FRICTION
        self.space.add(shape)

    def _add_robot(self, solids: Solids) -> None:
        robot = solids.robot
        body = pymunk.Body(robot.mass, solids.robot_inertia)
        wheels, pull = self._pull(body, self._first_rows[0], robot.traction)
        turn = GearJoint(wheels, body, 0.0, 1.0)
        turn.max_bias, turn.max_force = 0.0, robot.traction * robot.wheel_base / 2
        self._pulled.append((wheels, body, [pull, turn]))
        self._add_shape(pymunk.Circle(body, robot.radius), ROBOT)

    def _pull(
        self, body: pymunk.Body, row: Array, force: float
    ) -> tuple[pymunk.Body, PivotJoint]:  # fmt: skip
        """A kinematic body that pulls `body`, at the place of its `row`, with at most `force` N."""
        puller = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
        for each in (body, puller):
            each.position, each.angle = tuple(row[:2].tolist()), float(row[2])
        pull = PivotJoint(puller, body, (0, 0), (0, 0))
        pull.max_bias = 0.0  # match velocities only, do not correct positions
        pull.max_force = force
        self.space.add(body)
        return puller, pull

    def _add_doors(self, solids: Solids) -> None:
        for door, (x, y, angle) in zip(solids.layout.doors, solids.leaves.tolist(), strict=True):
            if solids.doors.fixed:
                body = pymunk.Body(body_type=pymunk.Body.STATIC)
            elif door.slides:
                body = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
            else:
                body = pymunk.Body(LEAF_MASS, solids.doors.inertia(door))
            body.position, body.angle = (x, y), angle
            self.space.add(body)
            if door.slides:
                self._hung.append((body, []))
            elif not solids.doors.fixed:
                self._hang(body, solids.doors.torque, solids.stops(door))
            margin = solids.leaf_margin(door)
            self._add_shape(pymunk.Poly(body, door.corners.tolist(), radius=margin), LEAF)

    def _hang(self, leaf: pymunk.Body, torque: float, stops: tuple[float, float]) -> None:
        frame = self.space.static_body
        motor = SimpleMotor(leaf, frame, 0.0)
        motor.max_force = torque
        stop = RotaryLimitJoint(frame, leaf, *stops)
        self.space.add(motor, stop)
        self._hung.append((leaf, [motor, stop]))

    def _add_people(self, solids: Solids) -> None:
        people, first = solids.people, 1 + len(self._hung)
        for row in self._first_rows[first : self._first_puller]:
            body = pymunk.Body(people.mass, float("inf"))
            feet, pull = self._pull(body, row, people.force)
            self._pulled.append((feet, body, [pull]))
            corners = solids.person.tolist()
            self._add_shape(pymunk.Poly(body, corners, radius=solids.person_margin), PERSON)

    def _check_order(self) -> None:
        """Raise RuntimeError if pymunk, which documents no order of bodies, has changed it."""
        before = self._rows.copy()
        self._place_each()
        self.states.advance(0, 1.0)
        count = len(self._in_order)
        if not np.array_equal(self._rows[:count], before[:count]):
            raise RuntimeError("pymunk lists its bodies in an order that dynslam does not know")

    # -- contacts ------------------------------------------------------------------------------

    def _count_contacts(self) -> None:
        for k, kind in enumerate(KINDS_TOUCHED):
            self._count_of_robot(k, kind)
        for kind in (FIXED, LEAF, PERSON):
            self._count_of_people(kind)

    def _count_of_robot(self, k: int, kind: int) -> None:
        contacts = self._contacts

        def begin(*_: object) -> None:
            contacts.current[k] += 1
            contacts.touched[k] = contacts.any = True

        def add_impulse(arbiter: pymunk.Arbiter, *_: object) -> None:
            impulse = TOTAL_IMPULSE(arbiter._arbiter)
            contacts.impulse += math.hypot(impulse.x, impulse.y)

        def separate(*_: object) -> None:
            contacts.current[k] -= 1

        self.space.on_collision(ROBOT, kind, begin=begin, post_solve=add_impulse, separate=separate)

    def _count_of_people(self, kind: int) -> None:
        def begin(*_: object) -> None:
            self._others += 1
            self._others_touched = True

        def separate(*_: object) -> None:
            self._others -= 1

        self.space.on_collision(PERSON, kind, begin=begin, separate=separate)
