"""The robot's body and what its wheels can do: a Pioneer 3-DX by default."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slam.kernel import kernel
from slam.validation import positive

Rows = NDArray[np.int64]


@dataclass(frozen=True)
class Robot:
    """A round robot with differential drive.

    Defaults: size, mass and speeds of the Pioneer 3-DX; accelerations of 0.3 m/s^2 and 100 deg/s^2,
    which its firmware is said to start with (not checked against a manual).

    radius            m
    mass              kg
    wheel_base        m, between the wheels
    max_speed         m/s, of the robot and of each wheel
    max_turn          rad/s
    acceleration      m/s^2
    turn_acceleration rad/s^2
    traction          N, with which the wheels can push at most
    """

    radius: float = 0.22
    mass: float = 9.0
    wheel_base: float = 0.33
    max_speed: float = 1.2
    max_turn: float = 5.2
    acceleration: float = 0.3
    turn_acceleration: float = 1.745
    traction: float = 60.0

    def __post_init__(self) -> None:
        positive(self, "radius", "mass", "wheel_base", "max_speed", "max_turn")
        positive(self, "acceleration", "turn_acceleration", "traction")

    def feasible(self, v: float, omega: float) -> tuple[float, float]:
        """The command (m/s, rad/s), slowed on the same arc until no wheel is too fast."""
        return _feasible(float(v), float(omega), self.max_speed, self.wheel_base)


class DifferentialDrive:
    """The wheels of n robots of one kind: what they make of commands, and how they then moved.

    Within a control step a robot's velocity keeps one direction, the arc's chord, while it turns.

    bodies      (n, 6) x, y, angle, vx, vy, omega as the physics has them, m, rad, s
    poses       (n, 3) m, m, rad
    velocities  (n, 2) m/s forward, rad/s turning
    observed    (n, 2) float32, the velocities within what the robot can do, for a Box
    wheels      (n, 3) m/s, m/s, rad/s: the velocity in the world with which the wheels pull
    """

    def __init__(self, robot: Robot, n: int, dt: float, delay: float):
        """`dt` s is a control step; what is asked for takes hold `delay` s after its beginning."""
        self.bodies, self.poses = np.zeros((n, 6)), np.zeros((n, 3))
        self.velocities, self.wheels = np.zeros((n, 2)), np.zeros((n, 3))
        self.observed = np.zeros((n, 2), dtype=np.float32)
        self._chords = np.zeros((n, 2))
        self._scale = np.array([robot.max_speed, robot.max_turn])
        most = robot.acceleration * dt, robot.turn_acceleration * dt
        self._settings = np.array([robot.wheel_base, *most, dt, delay])

    def place(self, i: int, body: NDArray[np.float64]) -> None:
        """Robot `i` begins where its body (6,) is, at rest."""
        self.bodies[i], self._chords[i] = body, 0.0
        self.settle(np.array([i]))

    def command(self, which: Rows, actions: NDArray[Any]) -> int:
        """Set the `wheels` of robots `which` for actions (n, 2), clipped to -1 .. 1.

        Gives the first robot whose action is not two finite numbers, or -1.
        """
        return _command(which, actions, self._scale, self._settings,
                        self.poses, self.velocities, self.wheels, self._chords)  # fmt: skip

    def settle(self, which: Rows) -> None:
        """Take in where the `bodies` of robots `which` are after a step."""
        _settle(which, self.bodies, self._chords, self._scale,
                self.poses, self.velocities, self.observed)  # fmt: skip


@kernel
def _feasible(v, omega, max_speed, wheel_base):
    wheel = abs(v) + abs(omega) * wheel_base / 2
    slower = min(1.0, max_speed / wheel) if wheel > 0 else 1.0
    return v * slower, omega * slower


@kernel
def _command(which, actions, scale, settings, poses, velocities, wheels, chords):
    wheel_base, most_v, most_omega, dt, delay = settings
    for i in which:
        a, b = float(actions[i, 0]), float(actions[i, 1])
        if not (math.isfinite(a) and math.isfinite(b)):
            return i
        v, omega = min(max(a, -1.0), 1.0) * scale[0], min(max(b, -1.0), 1.0) * scale[1]
        v0, omega0 = velocities[i, 0], velocities[i, 1]
        v, omega = _feasible(v, omega, scale[0], wheel_base)
        v = v0 + min(max(v - v0, -most_v), most_v)
        omega = omega0 + min(max(omega - omega0, -most_omega), most_omega)
        # on the way there a wheel may be asked for too much: then the robot turns, and drives less
        # fast, but brakes no harder than it can; and only then it turns less
        cap = max(scale[0] - abs(omega) * wheel_base / 2, 0.0)
        slowest = min(abs(v0) - most_v, scale[0])
        v = math.copysign(max(min(abs(v), cap), slowest), v)
        cap = 2 * max(scale[0] - abs(v), 0.0) / wheel_base
        omega = min(max(omega, -cap), cap)
        half = omega * dt / 2
        heading = poses[i, 2] + omega0 * delay + half  # in mid-arc
        chord = math.sin(half) / half if half else 1.0
        dx, dy = math.cos(heading), math.sin(heading)
        wheels[i, 0], wheels[i, 1], wheels[i, 2] = v * chord * dx, v * chord * dy, omega
        chords[i, 0], chords[i, 1] = dx / chord, dy / chord
    return -1


@kernel
def _settle(which, bodies, chords, scale, poses, velocities, observed):
    for i in which:
        angle = bodies[i, 2]
        poses[i, 0], poses[i, 1] = bodies[i, 0], bodies[i, 1]
        poses[i, 2] = angle - math.tau * np.rint(angle / math.tau)
        velocities[i, 0] = bodies[i, 3] * chords[i, 0] + bodies[i, 4] * chords[i, 1]
        velocities[i, 1] = bodies[i, 5]
        for k in range(2):
            observed[i, k] = min(max(velocities[i, k], -scale[k]), scale[k])
