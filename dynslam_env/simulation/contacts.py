"""Contacts of a robot with walls, doors and people, counted while Chipmunk moves the bodies."""

from __future__ import annotations

FIXED, LEAF, ROBOT, PERSON = 1, 2, 4, 8  # kinds of shapes, as bits
KINDS_TOUCHED = (FIXED, LEAF, PERSON)  # by the robot
CONTACT_COLUMNS = ("wall", "door", "person", "at_end", "impulse")  # of a step: see `Contacts.row`


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
