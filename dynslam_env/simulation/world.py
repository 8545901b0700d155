"""World: walls, hinged doors that flip, people who walk, and a robot that drives among them."""

from __future__ import annotations

import math
from array import array
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dynslam_env.simulation.bodies import (
    KEPT,
    MOST_COMMANDS,
    MOST_STEPS,
    NEXT_CONTROL,
    STEPS,
    Bodies,
)
from dynslam_env.simulation.contacts import Contacts
from dynslam_env.simulation.doors import DoorMotors, Doors
from dynslam_env.simulation.generator_state import GeneratorState
from dynslam_env.simulation.mechanics import Mechanics
from dynslam_env.simulation.people import People, Walkers
from dynslam_env.simulation.polygons import Polygons
from dynslam_env.simulation.robot import Robot
from dynslam_env.simulation.sliding import SlidingDoors
from dynslam_env.simulation.solids import Solids
from dynslam_env.simulation.world_step import (
    CONTROL_DT,
    CONTROLLED,
    FULL,
    PHYSICS_DT,
    SUBSTEPS,
    UNMOVED,
    begin_step,
    settle,
)
from dynslam_env.worlds.layout import LEAF_CORNERS, Door, Layout, corners_of
from dynslam_env.worlds.start_checks import check_people
from slam.geometry import Array, Pose2


class World:
    """The simulated world of one episode.

    Walls, leaves, robot and people are solid: see `Mechanics`. A command takes effect one physics
    step late, as in Chipmunk, which updates positions before velocities.

    A copy (`copy`, `pickle`) is built anew and makes all steps again: it continues bit for bit as
    the original. (A space that pymunk 7.3 copies does not always: it has lost the impulses of the
    joints, from which the solver starts. Of 20 crowds, 3 differed after 1 s, by 0.03 mm at most.)
    """

    _commands: array[float]
    """Arguments of the steps so far, three each, but for those that `Bodies` keeps."""

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
        self._begun = layout, robot, doors, people
        self._streams = GeneratorState(door_rng), GeneratorState(people_rng)
        self._commands, self._put_down = array("d"), {}
        count = len(layout.doors)
        is_open = doors.law.initial_states(door_rng.random(count) < doors.open_share, door_rng)
        self._clock = doors.law.clock(count, door_rng)
        self._doors = DoorMotors(layout.doors, doors, is_open)
        self._people = Walkers(people, layout, people_rng)
        places = self._people.starts()
        check_people(layout, places, people.radius, robot.radius)
        leaves = _leaves(layout.doors, self._doors, doors.open_angle)
        solids = Solids(layout, robot, doors, people, places, leaves, PHYSICS_DT)
        self._doors.rates, self._parts = solids.bodies.rates, solids.bodies.parts
        self._sliding = SlidingDoors(solids.hung, doors)
        self._robot_radius, self._open_angle = robot.radius, doors.open_angle
        self._split_states(solids.bodies)
        self._init_segments(solids)
        self.mechanics = Mechanics(solids, PHYSICS_DT)
        motors, shapes = self._doors, self._polygons
        self.moving = solids.memory, self.segments, motors.table, shapes.corners, shapes.first
        settle(*self.moving, motors.speed)
        self._control()

    # -- state ---------------------------------------------------------------------------------

    segments: Array
    """(w + e, 4) m, current: walls, then the edges of leaves, then of people."""

    first_edge: int
    """Index of the first edge in `segments`: the number of walls."""

    first_edges: NDArray[np.int64]
    """(1,) the same."""

    moving: tuple[Array, Array, Array, Array, NDArray[np.int64]]
    """First arguments of `begin_step`."""

    mechanics: Mechanics
    """Moves the bodies, and holds their states."""

    robot: Array
    """(6,) x, y, angle, vx, vy, omega of the robot, m and rad and s; a view."""

    @property
    def contacts(self) -> Contacts:
        """Contacts of the robot, now and in the last step."""
        return self.mechanics.contacts

    @property
    def steps(self) -> int:
        """Control steps since the start."""
        return int(self.moving[0].item(STEPS))

    @property
    def time(self) -> float:
        """Time since the start, s."""
        return self.moving[0].item(STEPS) * CONTROL_DT

    def outline(self) -> Array:
        """(e, 4) m, current edges of all movable solids."""
        return self.segments[self.first_edge :].copy()

    def poses(self) -> Array:
        """(m, 3) x, y in m, angle in rad, of all moving bodies except the robot."""
        return self._places.copy()

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
        return self._standing

    # -- one control step ----------------------------------------------------------------------

    def step(self, vx: float, vy: float, omega: float) -> None:
        """Step by CONTROL_DT seconds with the wheels at `vx`, `vy` m/s and `omega` rad/s."""
        remains = begin_step(*self.moving, self._doors.speed, (vx, vy, omega))
        if remains:
            self.finish_step(remains)

    def finish_step(self, remains: int) -> None:
        """Do what remains to be done of a step after `begin_step`."""
        if remains & UNMOVED:
            self.contacts.begin_step()
            self.mechanics.advance(SUBSTEPS)
            settle(*self.moving, self._doors.speed)
        if remains & CONTROLLED:
            self._control()
        if remains & FULL:
            self._make_room()

    def _make_room(self) -> None:
        """Move what `Bodies` keeps, where its room is used up."""
        bodies = self.mechanics.bodies
        if bodies.numbers[KEPT] + SUBSTEPS > MOST_STEPS:
            self.mechanics.catch_up()
        if self.steps % MOST_COMMANDS == 0:
            self._commands.extend(bodies.commands.flat)

    def __reduce__(self) -> tuple[Callable[..., World], tuple[Any, ...]]:
        """A copy is what the same calls give."""
        kept = self.mechanics.bodies.commands[: self.steps % MOST_COMMANDS]
        commands = self._commands + array("d", kept.flat)
        generators = [stream.generator() for stream in self._streams]
        return _replayed, ((*self._begun, *generators), commands, self._put_down)

    def _control(self) -> None:
        """Set the commands of doors that flip, and of people."""
        time = self.time
        if self._clock.next_flip <= time:
            for door in self._clock.flips_until(time):
                self._doors.flip(door)
            self._doors.drive(self._leaves, CONTROL_DT)
        if self._sliding:
            self._sliding.drive(self._solid, self._parts, self._doors, CONTROL_DT)
        if len(self._feet):
            self._steer_people()
        always = self._sliding or len(self._feet)
        self.moving[0][NEXT_CONTROL] = -math.inf if always else self._clock.next_flip

    def _steer_people(self) -> None:
        here = np.array([*self.robot[:2], self._robot_radius])
        shares = self.openings / self._open_angle
        self._people.steer(self.time, CONTROL_DT, self._walking, here, shares)
        self._feet[:] = self._people.velocities

    def put_robot(self, pose: Pose2) -> None:
        """Put the robot down at `pose`, at rest; the caller knows that it fits there."""
        self._put_down[self.steps] = pose
        self.mechanics.put_robot(pose)

    # -- building ------------------------------------------------------------------------------

    def _split_states(self, bodies: Bodies) -> None:
        """Views of the rows of robot, leaves and people, and of the commands of feet."""
        rows, (hung, count) = bodies.rows, map(int, bodies.numbers[:2])
        last_leaf, last = 1 + hung, 1 + hung + count
        self.robot, self._leaves = rows[0], rows[1:last_leaf]
        self._walking, self._movers, self._solid = rows[last_leaf:last], rows[1:last], rows[:last]
        self._places, self._standing = self._movers[:, :3], self._walking[:, :2]
        self._feet = rows[last + 1 : last + 1 + count, 3:5]

    def _init_segments(self, solids: Solids) -> None:
        """Allocate `segments`, and write the edges that never change: walls and fixed leaves."""
        walls, fixed = solids.layout.walls, solids.immovable
        people = [solids.person] * len(self._feet)
        self._polygons = Polygons([*corners_of(solids.hung), *people])
        self.first_edge, self.first_edges = len(walls), np.array([len(walls)])
        first_moving = self.first_edge + LEAF_CORNERS * len(fixed)
        self.segments = np.empty((first_moving + self._polygons.count, 4))
        self.segments[: self.first_edge] = walls
        if fixed:
            immovable = Polygons([*corners_of(fixed)])
            immovable.outline(solids.leaves[: len(fixed)], self.segments[self.first_edge :])


def _leaves(doors: tuple[Door, ...], motors: DoorMotors, angle: float) -> Array:
    """(d, 3) x, y, angle, m, m, rad, of the leaves at their targets."""
    opened = motors.is_open.tolist()
    places = [door.place(share, angle) for door, share in zip(doors, opened, strict=True)]
    leaves = np.array(places, dtype=np.float64).reshape(-1, 3)
    leaves[:, 2] = motors.targets
    return leaves


def _replayed(begun: tuple[Any, ...], commands: array[float], put_down: dict[int, Pose2]) -> World:
    """The world that begins as `begun` (the arguments of `World`) and makes the same steps."""
    world, wheels = World(*begun), np.reshape(commands, (-1, 3)).tolist()
    for step in range(len(wheels) + 1):
        if step in put_down:
            world.put_robot(put_down[step])
        if step < len(wheels):
            world.step(*wheels[step])
    return world
