"""World: robot, walls, hinged doors and people as bodies of a pymunk space."""

from __future__ import annotations

import copy
import math
from array import array
from collections.abc import Callable
from typing import Any

import numpy as np
import pymunk
from pymunk._chipmunk_cffi import lib
from pymunk.constraints import Constraint, GearJoint, PivotJoint, RotaryLimitJoint, SimpleMotor

from dynslam_env.simulation.chipmunk import BodyStates
from dynslam_env.simulation.doors import DoorMotors, Doors
from dynslam_env.simulation.people import People, Walkers
from dynslam_env.simulation.polygons import Polygons, regular
from dynslam_env.simulation.robot import Robot
from dynslam_env.worlds.layout import Door, Layout
from dynslam_env.worlds.start_checks import check_people
from slam.errors import InputError
from slam.geometry import Array, Pose2

CONTROL_DT = 0.1  # s, one step of the environment
SUBSTEPS = 10  # physics steps per control step
PHYSICS_DT = CONTROL_DT / SUBSTEPS
FIXED, LEAF, ROBOT, PERSON = 1, 2, 4, 8  # kinds of shapes, as bits
KINDS_TOUCHED = (FIXED, LEAF, PERSON)  # by the robot
CONTACT_COLUMNS = ("wall", "door", "person", "at_end", "impulse")  # of a step: see `Contacts.row`
COLLIDES_WITH = {FIXED: ROBOT | PERSON, LEAF: ROBOT | PERSON, ROBOT: FIXED | LEAF | PERSON,
         PERSON: FIXED | LEAF | ROBOT | PERSON}  # fmt: skip
MAX_PENETRATION = 0.009  # m, of two solids in the physics step before the contact is resolved
FILTERS = {
    kind: pymunk.ShapeFilter(categories=kind, mask=mask) for kind, mask in COLLIDES_WITH.items()
}
LEAF_MASS = 1e30  # kg: a leaf turns about its hinge, which needs no joint to stay in place
MAX_TIP_SPEED = 3.0  # m/s, of a leaf: a faster one would need a thick margin
PERSON_CORNERS = 8
SET_VELOCITY, SET_ANGULAR_VELOCITY = lib.cpBodySetVelocity, lib.cpBodySetAngularVelocity
SET_RATE = lib.cpSimpleMotorSetRate
TOTAL_IMPULSE = lib.cpArbiterTotalImpulse


class Contacts:
    """Contacts of the robot with walls, doors and people: `KINDS_TOUCHED`.

    any      whether there were any in this step
    current  number of contacts now, of each kind
    touched  whether there were any in this step, of each kind
    impulse  N s, sum of the magnitudes of the impulses of all contacts in this step
    """

    def __init__(self) -> None:
        self.any = False
        self.current = [0] * len(KINDS_TOUCHED)
        self.touched = [False] * len(KINDS_TOUCHED)
        self.impulse = 0.0

    def begin_step(self) -> None:
        """Forget the last step."""
        if self.any:
            self.touched = [count > 0 for count in self.current]
            self.any, self.impulse = any(self.touched), 0.0

    def row(self) -> tuple[float, ...]:
        """The step in numbers, as `CONTACT_COLUMNS`."""
        return *self.touched, any(self.current), self.impulse

    def watch(self, space: pymunk.Space) -> None:
        """Count the contacts of the robot in a space."""
        for k, kind in enumerate(KINDS_TOUCHED):
            self._watch(space, k, kind)

    def _watch(self, space: pymunk.Space, k: int, kind: int) -> None:
        def begin(*_: object) -> None:
            self.current[k] += 1
            self.touched[k] = self.any = True

        def add_impulse(arbiter: pymunk.Arbiter, *_: object) -> None:
            impulse = TOTAL_IMPULSE(arbiter._arbiter)
            self.impulse += math.hypot(impulse.x, impulse.y)

        def separate(*_: object) -> None:
            self.current[k] -= 1

        space.on_collision(ROBOT, kind, begin=begin, post_solve=add_impulse, separate=separate)


class World:
    """The simulated world of one episode.

    The wheels are a kinematic body with the commanded velocity that pulls the robot by two joints
    of limited force (setting the robot's own velocity would press it into walls). People are driven
    in the same way. pymunk updates positions before velocities: a command takes effect one physics
    step later.

    A copy (`copy`, `pickle`) is built anew and makes all steps again: it continues bit for bit as
    the original. (A space that pymunk 7.3 copies does not always: it has lost the impulses of the
    joints, from which the solver starts. Of 20 crowds, 3 differed after 1 s, by 0.03 mm at most.)
    """

    _commands: array[float]
    """Arguments of all steps so far, three each."""

    _put_down: dict[int, Pose2]
    """Poses at which the robot was put down, by the number of steps before."""

    def __init__(
        self,
        layout: Layout,
        robot: Robot,
        doors: Doors,
        people: People,
        door_rng: np.random.Generator,
        people_rng: np.random.Generator,
    ):
        generators = copy.deepcopy((door_rng, people_rng))  # as they are before the first draw
        self._begun = layout, robot, doors, people, *generators
        self._commands, self._put_down = array("d"), {}
        count = len(layout.doors)
        self.steps = 0
        self._space = pymunk.Space()
        self._space.collision_slop = 0.0005  # m; pymunk's default is meant for pixels
        is_open = doors.law.initial_states(door_rng.random(count) < doors.open_share, door_rng)
        self._clock = doors.law.clock(count, door_rng)
        self._doors = DoorMotors(layout.doors, doors, is_open)
        self._people = Walkers(people, layout, people_rng)
        places = self._people.starts()
        check_people(layout, places, people.radius, robot.radius)
        self._fastest = robot.max_speed
        self._add_walls(layout.walls)
        self._robot_radius, self._open_angle = robot.radius, doors.open_angle
        self._pulling: list[pymunk.Body | Constraint] = []
        self._puller, self._body = self._add_robot(layout.start, robot)
        self._wheels = self._puller._body
        self._add_doors(layout.doors, doors)
        self._add_people(people, places)
        self._space.add(*self._pulling)
        self.contacts = Contacts()
        self.contacts.watch(self._space)
        self.states = BodyStates(self._space)
        self._split_states(self.states.rows)
        self._init_segments(layout)
        self.states.advance(0, PHYSICS_DT)
        self._check_order(layout, places)
        self._control()

    # -- state ---------------------------------------------------------------------------------

    segments: Array
    """(w + e, 4) m, current: walls, then the edges of leaves, then of people."""

    first_edge: int
    """Index of the first edge in `segments`: the number of walls."""

    states: BodyStates
    """Steps the physics, and holds the states of all bodies."""

    robot: Array
    """(6,) x, y, angle, vx, vy, omega of the robot, m and rad and s; a view."""

    contacts: Contacts
    """Contacts of the robot, now and in the last step."""

    @property
    def time(self) -> float:
        """Time since the start, s."""
        return self.steps * CONTROL_DT

    def outline(self) -> Array:
        """(e, 4) m, current edges of all movable solids."""
        return self.segments[self.first_edge :].copy()

    def poses(self) -> Array:
        """(m, 3) x, y in m, angle in rad, of all moving bodies except the robot."""
        return self._movers[:, :3].copy()

    def outlines(self, poses: Array) -> Array:
        """(t, e, 4) m, the `outline` at each of the `poses` (t, m, 3) of the bodies."""
        edges = np.repeat(self.segments[None, self.first_edge :], len(poses), axis=0)
        fixed = edges.shape[1] - self._polygons.count
        for rows, at in zip(edges, poses, strict=True):
            self._polygons.outline(at, rows[fixed:])
        return edges

    @property
    def bodies(self) -> Array:
        """(b, 6) x, y, angle, vx, vy, omega of the robot, of moving leaves, and of people."""
        return np.vstack([self.robot, self._movers])

    @property
    def openings(self) -> Array:
        """(d,) rad, opening angles of the doors: 0 closed, positive open; a view."""
        return self._doors.openings

    @property
    def people(self) -> Array:
        """(p, 2) m, positions of the people; a view."""
        return self._walking[:, :2]

    # -- one control step ----------------------------------------------------------------------

    def step(self, vx: float, vy: float, omega: float) -> None:
        """Step by CONTROL_DT seconds with the wheels at `vx`, `vy` m/s and `omega` rad/s."""
        self._commands.extend((vx, vy, omega))
        wheels = self._wheels
        SET_VELOCITY(wheels, (vx, vy))
        SET_ANGULAR_VELOCITY(wheels, omega)
        self.contacts.begin_step()
        self.states.advance(SUBSTEPS, PHYSICS_DT)
        self.steps += 1
        self._control()

    def __reduce__(self) -> tuple[Callable[..., World], tuple[Any, ...]]:
        """A copy is what the same calls give."""
        return _replayed, (self._begun, self._commands, self._put_down)

    def _control(self) -> None:
        """Update the edges from the states, and set the commands of doors and people."""
        self._polygons.outline(self._movers, self._moving_edges)
        time = self.steps * CONTROL_DT
        if self._clock.next_flip <= time:
            for door in self._clock.flips_until(time):
                self._doors.flip(door)
        if self._motors and (changed := self._doors.drive(self._leaves, CONTROL_DT)):
            for door in self._doors.changed[:changed].tolist():
                SET_RATE(self._motors[door]._constraint, self._doors.rates[door])
        if self._feet:
            self._steer_people()

    def _steer_people(self) -> None:
        here = np.array([*self.robot[:2], self._robot_radius])
        shares = self.openings / self._open_angle
        self._people.steer(self.time, CONTROL_DT, self._walking, here, shares)
        for feet, velocity in zip(self._feet, self._people.velocities.tolist(), strict=True):
            SET_VELOCITY(feet._body, velocity)

    def put_robot(self, pose: Pose2) -> None:
        """Put the robot down at `pose`, at rest; the caller knows that it fits there."""
        self._put_down[self.steps] = pose
        for body in (self._puller, self._body):
            body.position, body.angle = (pose.x, pose.y), pose.theta
            body.velocity, body.angular_velocity = (0.0, 0.0), 0.0
        self.states.advance(0, PHYSICS_DT)

    # -- building ------------------------------------------------------------------------------

    def _add_walls(self, walls: Array) -> None:
        static = self._space.static_body
        for x1, y1, x2, y2 in walls.tolist():
            self._add_shape(pymunk.Segment(static, (x1, y1), (x2, y2), self._margin(0.0)), FIXED)

    def _margin(self, speed: float) -> float:
        """Collision margin in m around a solid of this speed, m/s; the laser does not see it."""
        return max((self._fastest + speed) * PHYSICS_DT - MAX_PENETRATION, 0.0)

    def _add_shape(self, shape: pymunk.Shape, kind: int) -> None:
        shape.filter = FILTERS[kind]
        shape.collision_type, shape.friction = kind, 0.2
        self._space.add(shape)

    def _add_robot(self, start: Pose2, robot: Robot) -> tuple[pymunk.Body, pymunk.Body]:
        """The wheels, and the body that they pull."""
        moment = pymunk.moment_for_circle(robot.mass, 0, robot.radius)
        body = pymunk.Body(robot.mass, moment)
        body.position, body.angle = (start.x, start.y), start.theta
        wheels = self._pulled(body, robot.traction)
        turn = GearJoint(wheels, body, 0.0, 1.0)
        turn.max_bias, turn.max_force = 0.0, robot.traction * robot.wheel_base / 2
        self._pulling.append(turn)
        self._add_shape(pymunk.Circle(body, robot.radius), ROBOT)
        return wheels, body

    def _pulled(self, body: pymunk.Body, force: float) -> pymunk.Body:
        """A kinematic body that pulls `body` with at most `force` N."""
        puller = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
        puller.position, puller.angle = body.position, body.angle
        pull = PivotJoint(puller, body, (0, 0), (0, 0))
        pull.max_bias = 0.0  # match velocities only, do not correct positions
        pull.max_force = force
        self._space.add(body)
        self._pulling += [puller, pull]
        return puller

    def _add_doors(self, layout: tuple[Door, ...], doors: Doors) -> None:
        self._motors: list[SimpleMotor] = []
        for door, angle in zip(layout, self._doors.targets.tolist(), strict=True):
            if doors.fixed:
                body = pymunk.Body(body_type=pymunk.Body.STATIC)
            else:
                body = pymunk.Body(LEAF_MASS, doors.inertia(door))
            body.position, body.angle = door.hinge, angle
            self._space.add(body)
            if not doors.fixed:
                self._add_motor(body, door, doors)
            margin = self._margin(0.0 if doors.fixed else _tip_speed(door, doors))
            self._add_shape(pymunk.Poly(body, door.corners.tolist(), radius=margin), LEAF)

    def _add_motor(self, body: pymunk.Body, door: Door, doors: Doors) -> None:
        frame = self._space.static_body
        motor = SimpleMotor(body, frame, 0.0)
        motor.max_force = doors.torque
        angles = door.closed, door.closed + door.swing * doors.open_angle
        self._space.add(motor, RotaryLimitJoint(frame, body, min(angles), max(angles)))
        self._motors.append(motor)

    def _add_people(self, people: People, places: Array) -> None:
        self._feet: list[pymunk.Body] = []
        self._person = regular(people.radius, PERSON_CORNERS)
        for x, y in places.tolist():
            body = pymunk.Body(people.mass, float("inf"))
            body.position = x, y
            self._feet.append(self._pulled(body, people.force))
            margin = self._margin(people.speed)
            self._add_shape(pymunk.Poly(body, self._person.tolist(), radius=margin), PERSON)

    def _split_states(self, rows: Array) -> None:
        """Views of the states of robot, leaves and people, the order in which they were added."""
        last_leaf = 1 + len(self._motors)
        last = last_leaf + len(self._feet)
        self.robot, self._leaves = rows[0], rows[1:last_leaf]
        self._walking, self._movers = rows[last_leaf:last], rows[1:last]

    def _check_order(self, layout: Layout, people: Array) -> None:
        """Raise RuntimeError if pymunk, which documents no order of bodies, has changed it."""
        hinges = [door.hinge for door in layout.doors] if self._motors else []
        places = np.array([layout.start[:2], *hinges, *people.tolist()])
        if not np.array_equal(self.bodies[:, :2], places):
            raise RuntimeError("pymunk lists its bodies in an order that dynslam does not know")

    def _init_segments(self, layout: Layout) -> None:
        """Allocate `segments`, and write the edges that never change: walls and fixed leaves."""
        leaves = [door.corners for door in layout.doors]
        fixed, hung = ([], leaves) if self._motors else (leaves, [])
        self._polygons = Polygons([*hung, *[self._person] * len(self._feet)])
        immovable = Polygons(fixed)
        self.first_edge = len(layout.walls)
        first_moving = self.first_edge + immovable.count
        self.segments = np.empty((first_moving + self._polygons.count, 4))
        self.segments[: self.first_edge] = layout.walls
        self._moving_edges = self.segments[first_moving:]
        hinges = np.array([door.hinge for door in layout.doors]).reshape(-1, 2)
        poses = np.column_stack([hinges, self._doors.targets])[: len(fixed)]
        immovable.outline(poses, self.segments[self.first_edge :])


def _replayed(begun: tuple[Any, ...], commands: array[float], put_down: dict[int, Pose2]) -> World:
    """The world that begins as `begun` (the arguments of `World`) and makes the same steps."""
    world, wheels = World(*begun), np.reshape(commands, (-1, 3)).tolist()
    for step in range(len(wheels) + 1):
        if step in put_down:
            world.put_robot(put_down[step])
        if step < len(wheels):
            world.step(*wheels[step])
    return world


def _tip_speed(door: Door, doors: Doors) -> float:
    """Speed of a leaf's free edge at full speed, m/s; raises InputError beyond MAX_TIP_SPEED."""
    speed = doors.speed * door.width
    if speed > MAX_TIP_SPEED:
        raise InputError(
            f"a leaf {door.width:g} m wide cannot open in Doors.swing_time = "
            f"{doors.swing_time:g} s: its edge may move at {MAX_TIP_SPEED:g} m/s at most"
        )
    return speed
