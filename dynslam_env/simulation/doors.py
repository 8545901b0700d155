"""Doors: their parameters, and the motors that turn the leaves."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from dynslam_env.simulation.laws import Coupled, Fixed, Law, Uniform
from dynslam_env.worlds.layout import Door
from slam.geometry import Array
from slam.kernel import kernel
from slam.validation import instance, positive, within

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

    rates     (d,) rad/s, commanded rates
    changed   (d,) its first entries are the doors whose rates the last `drive` changed
    openings  (d,) rad, opening angles: 0 closed, positive open
    """

    def __init__(self, leaves: tuple[Door, ...], doors: Doors, is_open: np.ndarray):
        self._closed = np.array([door.closed for door in leaves])
        self._swing = np.array([door.swing for door in leaves], dtype=np.float64)
        self._angle, self._is_open = doors.open_angle, is_open.copy()
        self._speed = doors.speed
        self._braking = np.array([BRAKING_SHARE * doors.torque / doors.inertia(d) for d in leaves])
        self._targets = self._closed + self._swing * self._angle * is_open
        self.rates = np.zeros(len(leaves))
        self.changed = np.zeros(len(leaves), dtype=np.int64)
        self.openings = doors.open_angle * is_open.astype(np.float64)

    @property
    def targets(self) -> Array:
        """(d,) rad, world, target angles of the leaves."""
        return self._targets

    def flip(self, door: int) -> None:
        """Close an open door, open a closed one."""
        self._is_open[door] ^= True
        opened = self._swing[door] * self._angle * self._is_open[door]
        self._targets[door] = self._closed[door] + opened

    def drive(self, leaves: Array, dt: float) -> int:
        """Set the rates for the next `dt` s from the leaves' angles; the number of rates changed.

        leaves (d, 6) states of the bodies: x, y, angle, ...
        """
        return _drive(leaves, dt, self._targets, self._speed, self._braking,
                      self._closed, self._swing, self.rates, self.changed,
                      self.openings)  # fmt: skip


@kernel
def _drive(leaves, dt, targets, speed, braking, closed, swing, rates, changed, openings):
    """Full speed, limited so that the leaf can still brake to rest at its target."""
    count = 0
    for d in range(len(leaves)):
        angle = leaves[d, 2]
        openings[d] = (angle - closed[d]) * swing[d] + 0.0  # + 0.0 turns -0.0 into 0.0
        error = targets[d] - angle
        distance, rate = abs(error), 0.0
        if distance >= 1e-6:
            rate = min(speed, math.sqrt(2 * braking[d] * distance), distance / dt)
            rate = math.copysign(rate, error)
        if rate != rates[d]:
            rates[d], changed[count] = rate, d
            count += 1
    return count
