"""SlidingDoors: leaves that slide into the wall, and wait while somebody is in the doorway."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from dynslam_env.simulation.columns import RADIUS
from dynslam_env.simulation.doors import DoorMotors, Doors
from dynslam_env.worlds.layout import Door
from slam.geometry import Array

SENSOR_RANGE = 0.15  # m: a leaf does not close while robot or person is nearer to its way
RESTING = 1e-9  # m: nearer than that, a leaf is where it shall be


class SlidingDoors:
    """Control of the leaves that slide, which a motor moves at constant speed; nothing pushes them.

    As an automatic door does (EN 16005), a leaf that closes stops while a sensor sees somebody in
    the doorway; one that opens goes on.
    """

    def __init__(self, leaves: tuple[Door, ...], doors: Doors):
        self._which = [i for i, door in enumerate(leaves) if door.slides]
        chosen = [leaves[i] for i in self._which]
        self._widths = [door.width for door in chosen]
        self._along = [(math.cos(door.closed), math.sin(door.closed)) for door in chosen]
        self._hinges = [door.hinge for door in chosen]
        self._angle, self._time = doors.open_angle, doors.swing_time

    def __bool__(self) -> bool:
        """Whether there are any."""
        return bool(self._which)

    def drive(self, bodies: Array, parts: Array, motors: DoorMotors, dt: float) -> None:
        """Set the velocities of the leaves for the next `dt` s, and their openings.

        bodies  (1 + d + p, 6) states of the robot, the leaves and the people; velocities written
        parts   see `Bodies`
        """
        is_open: NDArray[np.bool_] = motors.is_open
        discs = [0, *range(1 + len(is_open), len(parts))]
        around = np.column_stack([bodies[discs, :2], parts[discs, RADIUS]]).tolist()
        for k, i in enumerate(self._which):
            width, (c, s), (x, y) = self._widths[k], self._along[k], self._hinges[k]
            row = bodies[1 + i]
            opened = (x - float(row[0])) * c + (y - float(row[1])) * s  # m
            motors.openings[i] = min(max(opened / width, 0.0), 1.0) * self._angle + 0.0
            left = width * bool(is_open[i]) - opened
            waits = left < 0 and any(self._sees(k, each) for each in around)
            speed = 0.0
            if abs(left) > RESTING and not waits:
                speed = math.copysign(min(width / self._time, abs(left) / dt), left)
            row[3], row[4] = -speed * c + 0.0, -speed * s + 0.0  # + 0.0 turns -0.0 into 0.0

    def _sees(self, k: int, disc: list[float]) -> bool:
        """Whether a disc x, y, radius, m, is within the sensor's range of the closed leaf."""
        (c, s), (x, y) = self._along[k], self._hinges[k]
        dx, dy = disc[0] - x, disc[1] - y
        along = min(max(dx * c + dy * s, 0.0), self._widths[k])
        return math.hypot(dx - along * c, dy - along * s) < disc[2] + SENSOR_RANGE
