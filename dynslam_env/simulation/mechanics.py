"""Mechanics: moves the bodies of a world, by Chipmunk only while something touches."""

from __future__ import annotations

import math

from dynslam_env.simulation.contact_space import ContactSpace
from dynslam_env.simulation.contacts import Contacts
from dynslam_env.simulation.free_motion import Fixtures, move_freely
from dynslam_env.simulation.index_boxes import MOST_STEPS, index_boxes
from dynslam_env.simulation.solids import Solids
from slam.geometry import Array, Pose2

LEFT_PER_SECOND = math.pow(0.8999999761581421, 60.0)  # of an overshoot, by Chipmunk's joints


class Mechanics:
    """The moving bodies of a world.

    Where nothing touches anything, `free_motion` gives the same numbers as Chipmunk to the bit. A
    space of Chipmunk is made when it is first needed.

    bodies    states and joints of the bodies
    contacts  of the robot, now and in the last step
    """

    def __init__(self, solids: Solids, segments: Array, fixed: int, dt: float):
        """`segments`: the first `fixed` (., 4) m never move; `dt`: a physics step, s."""
        self.bodies, self.contacts = solids.bodies, Contacts()
        self._solids, self._dt = solids, dt
        stop_bias = 1.0 - math.pow(LEFT_PER_SECOND, dt)
        self._fixtures = Fixtures(segments, fixed, solids.margin, stop_bias)
        self._space: ContactSpace | None = None
        rows, parts = self.bodies.rows, self.bodies.parts
        self._index = index_boxes(rows, parts, len(solids.hung))
        self._apart = True

    def advance(self, steps: int) -> None:
        """Move by so many physics steps."""
        self.contacts.begin_step()
        if not (self._apart and self._move_freely(steps)):
            self._move_in_space(steps)

    def put_robot(self, pose: Pose2) -> None:
        """Put robot and wheels down, at rest."""
        wheels = len(self.bodies.parts)
        for row in (self.bodies.rows[0], self.bodies.rows[wheels]):
            row[:] = *pose, 0.0, 0.0, 0.0
        if self._space is not None and not self._apart:
            self._space.place()

    def in_space(self) -> ContactSpace:
        """The bodies as they are now in a space of Chipmunk, by which they move next."""
        space = self._made_space()
        if self._apart:
            space.enter(self._dt)
            self._apart = False
        return space

    def _made_space(self) -> ContactSpace:
        if self._space is None:
            self._space = ContactSpace(self._solids, self.contacts, self._index)
        return self._space

    def _move_freely(self, steps: int) -> bool:
        if self._index.kept[0] + steps > MOST_STEPS:
            self._made_space().catch_up(self._dt)
        return move_freely(self.bodies, self._index, self._fixtures, steps, self._dt)

    def _move_in_space(self, steps: int) -> None:
        space = self.in_space()
        space.advance(steps, self._dt)
        self._apart = not space.touching
