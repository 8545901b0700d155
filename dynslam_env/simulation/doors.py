"""Doors: their parameters, and the motors that turn the leaves."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from dynslam_env.simulation.laws import Coupled, Fixed, Law, Uniform
from dynslam_env.worlds.layout import Door
from slam.geometry import Array
from slam.kernel import kernel
from slam.validation import instance, positive, within

TARGET, CLOSED, SWING, BRAKING, OPENING = 0, 1, 2, 3, 4  # rows: rad, rad, -1 or 1, rad/s^2, rad
DOOR_ROWS = 5
BRAKING_SHARE = 0.75  # of the torque, assumed available to slow a leaf down; the rest is reserve


@dataclass(frozen=True)
class Doors:
    """The law by which doors flip, and their mechanics.

    law         when doors flip: `Uniform`, `Exponential`, `Periodic`, `Scripted`, `Coupled`; with
                `Fixed` they never flip, and their leaves are immovable
    open_share  probability that a door is open at the start
    open_angle  rad, of an open door
    swing_time  s, from closed to open at full speed
    torque      N m, largest torque of a door's motor, and its resistance to being pushed
    mass        kg, of a leaf
    """

    law: Law = field(default=Uniform())
    open_share: float = 0.5
    open_angle: float = math.pi / 2
    swing_time: float = 1.5
    torque: float = 8.0
    mass: float = 10.0

    def __post_init__(self) -> None:
        instance("Doors.law", self.law, Law)
        positive(self, "open_angle", "swing_time", "torque", "mass")
        within(self, "open_share", 0.0, 1.0)
        within(self, "open_angle", 0.0, math.pi / 2)

    @property
    def fixed(self) -> bool:
        """Whether the leaves are immovable."""
        law = self.law
        while isinstance(law, Coupled):
            law = law.law
        return isinstance(law, Fixed)

    @property
    def speed(self) -> float:
        """Full angular speed of a leaf, rad/s."""
        return self.open_angle / self.swing_time

    def inertia(self, door: Door) -> float:
        """Moment of inertia of a leaf about its hinge, kg m^2: a thin plate about its edge."""
        return self.mass * door.width**2 / 3


class DoorMotors:
    """Control of the leaves of a layout: each has a target angle and a rate towards it.

    table     (5, d) see `DOOR_ROWS`; to it, leaves that slide are closed: see `SlidingDoors`
    rates     (d,) rad/s, commanded rates
    openings  (d,) rad, opening angles: 0 closed, positive open; of leaves that slide, the share
              that is open of a full opening; a view
    """

    def __init__(self, leaves: tuple[Door, ...], doors: Doors, is_open: np.ndarray):
        swing = np.array([door.swing for door in leaves], dtype=np.float64)
        self._angle, self._is_open = doors.open_angle, is_open.copy()
        self._turns = np.array([not door.slides for door in leaves], dtype=np.bool_)
        self.speed = doors.speed
        self.table = np.zeros((DOOR_ROWS, len(leaves)))
        self.table[CLOSED] = [door.closed for door in leaves]
        self.table[SWING] = swing
        self.table[BRAKING] = [BRAKING_SHARE * doors.torque / doors.inertia(d) for d in leaves]
        self.table[TARGET] = self.table[CLOSED] + swing * self._angle * (is_open & self._turns)
        self.table[OPENING] = doors.open_angle * is_open.astype(np.float64)
        self.openings, self.rates = self.table[OPENING], np.zeros(len(leaves))

    @property
    def targets(self) -> Array:
        """(d,) rad, world, target angles of the leaves."""
        return self.table[TARGET]

    @property
    def is_open(self) -> NDArray[np.bool_]:
        """(d,) whether the doors shall be open; a view."""
        return self._is_open

    def flip(self, door: int) -> None:
        """Close an open door, open a closed one."""
        self._is_open[door] = is_open = not self._is_open[door]
        target = self.table.item(CLOSED, door)
        if is_open and self._turns[door]:
            target += self.table.item(SWING, door) * self._angle
        self.table[TARGET, door] = target

    def drive(self, leaves: Array, dt: float) -> int:
        """Set the rates for the next `dt` s from the leaves' angles; the number of rates changed.

        leaves (d, 6) states of the bodies: x, y, angle, ...
        """
        return drive(leaves, dt, self.table, self.speed, self.rates)


@kernel
def drive(leaves, dt, table, speed, rates):
    """Full speed, limited so that the leaf can still brake to rest at its target.

    The number of rates changed; see `DoorMotors`.
    """
    count = 0
    for d in range(len(leaves)):
        angle = leaves[d, 2]
        # + 0.0 turns -0.0 into 0.0
        table[OPENING, d] = (angle - table[CLOSED, d]) * table[SWING, d] + 0.0
        error = table[TARGET, d] - angle
        distance, rate = abs(error), 0.0
        if distance >= 1e-6:
            rate = min(speed, math.sqrt(2 * table[BRAKING, d] * distance), distance / dt)
            rate = math.copysign(rate, error)
        if rate != rates[d]:
            rates[d] = rate
            count += 1
    return count
