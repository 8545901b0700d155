"""Mechanics: moves the bodies of a world, by Chipmunk only while something touches."""

from __future__ import annotations

from dynslam_env.simulation.bodies import APART
from dynslam_env.simulation.contact_space import ContactSpace
from dynslam_env.simulation.contacts import Contacts
from dynslam_env.simulation.solids import Solids
from slam.geometry import Pose2


class Mechanics:
    """The moving bodies of a world.

    While nothing touches anything, the caller moves them by `free_motion`, which gives the same
    numbers as Chipmunk to the bit. A space of Chipmunk is made when it is first needed.

    bodies    states and joints of the bodies
    contacts  of the robot, now and in the last step
    """

    def __init__(self, solids: Solids, dt: float):
        """`dt`: a physics step, s."""
        self.bodies, self.contacts = solids.bodies, Contacts()
        self._solids, self._dt = solids, dt
        self._space: ContactSpace | None = None

    @property
    def apart(self) -> bool:
        """Whether nothing touched anything in the last step."""
        return bool(self.bodies.numbers[APART])

    def catch_up(self) -> None:
        """Make room for more steps that are not made in a space of Chipmunk."""
        self._made_space().catch_up(self._dt)

    def advance(self, steps: int) -> None:
        """Make so many physics steps in a space of Chipmunk."""
        space = self.in_space()
        space.advance(steps, self._dt)
        self.bodies.numbers[APART] = not space.touching

    def put_robot(self, pose: Pose2) -> None:
        """Put robot and wheels down, at rest."""
        wheels = len(self.bodies.parts)
        for row in (self.bodies.rows[0], self.bodies.rows[wheels]):
            row[:] = *pose, 0.0, 0.0, 0.0
        if self._space is not None and not self.apart:
            self._space.place()

    def in_space(self) -> ContactSpace:
        """The bodies as they are now in a space of Chipmunk, by which they move next."""
        space = self._made_space()
        if self.apart:
            space.enter(self._dt)
            self.bodies.numbers[APART] = False
        return space

    def _made_space(self) -> ContactSpace:
        if self._space is None:
            self._space = ContactSpace(self._solids, self.contacts)
        return self._space
