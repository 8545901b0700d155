"""Robot: body and limits of a differential-drive robot, by default of a Pioneer 3-DX."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slam.kernel import kernel
from slam.validation import positive

Rows = NDArray[np.int64]


@dataclass(frozen=True)
class Robot:
    """A circular robot with differential drive.

    Defaults: size, mass and speeds of the Pioneer 3-DX; accelerations of 0.3 m/s^2 and 100 deg/s^2,
    which its firmware is said to start with (not checked against a manual).

    radius            m
    mass              kg
    wheel_base        m, between the wheels
    max_speed         m/s, of the robot and of each wheel
    max_turn          rad/s
    acceleration      m/s^2
    turn_acceleration rad/s^2
    traction          N, largest force with which the wheels push
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
        """The command (m/s, rad/s), slowed on the same arc until no wheel exceeds its limit."""
        return _feasible(float(v), float(omega), self.max_speed, self.wheel_base)


class DifferentialDrive:
    """The wheels of n equal robots: commands to wheel velocities, body states to velocities.

    Within a control step the velocity of a robot has the direction of the chord of its arc.

    bodies      (n, 6) states of the bodies: x, y, angle, vx, vy, omega, m, rad, s
    poses       (n, 3) m, m, rad
    velocities  (n, 2) m/s forward, rad/s turning
    wheels      (n, 3) commanded velocity in the world frame, m/s, m/s, rad/s
    rolled      (n, 2) what the wheels turn in the step of the last command, m and rad
    """

    def __init__(self, robot: Robot, n: int, dt: float, delay: float):
        """`dt`: a control step, s; `delay`: from its start until a command takes effect, s."""
        self.bodies, self.poses = np.zeros((n, 6)), np.zeros((n, 3))
        self.velocities, self.wheels = np.zeros((n, 2)), np.zeros((n, 3))
        self.rolled, self.speeds = np.zeros((n, 2)), np.zeros((n, 2))
        self.chords = np.zeros((n, 2))
        self.scale = np.array([robot.max_speed, robot.max_turn])
        most = robot.acceleration * dt, robot.turn_acceleration * dt
        self.settings = np.array([robot.wheel_base, *most, dt, delay])

    def place(self, i: int, body: NDArray[np.float64]) -> None:
        """Place robot `i` at the pose of its body (6,), at rest."""
        self.bodies[i], self.chords[i], self.speeds[i] = body, 0.0, 0.0
        self.read_bodies(np.array([i]))

    def read_bodies(self, which: Rows) -> None:
        """Update poses and velocities of robots `which` from their `bodies`."""
        read_bodies(which, self.bodies, self.chords, self.poses, self.velocities)


@kernel
def _feasible(v, omega, max_speed, wheel_base):
    wheel = abs(v) + abs(omega) * wheel_base / 2
    slower = min(1.0, max_speed / wheel) if wheel > 0 else 1.0
    return v * slower, omega * slower


@kernel
def command(
    which, actions, scale, settings, poses, velocities, wheels, chords, speeds, rolled
):  # fmt: skip
    """Set the `wheels` of robots `which` for actions (n, 2), clipped to -1 .. 1; see
    `DifferentialDrive`.

    Also their `chords`, the `speeds` (n, 2) of the wheels, m/s and rad/s, and `rolled`. Returns the
    first robot whose action is not two finite numbers, or -1.
    """
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
        # the accelerations may lead to a pair that is too fast for a wheel: then reduce the forward
        # velocity, within the deceleration limit, and only then the turning velocity
        cap = max(scale[0] - abs(omega) * wheel_base / 2, 0.0)
        slowest = min(abs(v0) - most_v, scale[0])
        v = math.copysign(max(min(abs(v), cap), slowest), v)
        cap = 2 * max(scale[0] - abs(v), 0.0) / wheel_base
        omega = min(max(omega, -cap), cap)
        half = omega * dt / 2
        heading = poses[i, 2] + omega0 * delay + half  # of the chord
        chord = math.sin(half) / half if half else 1.0
        dx, dy = math.cos(heading), math.sin(heading)
        wheels[i, 0], wheels[i, 1], wheels[i, 2] = v * chord * dx, v * chord * dy, omega
        chords[i, 0], chords[i, 1] = dx / chord, dy / chord
        rolled[i, 0] = delay * speeds[i, 0] + (dt - delay) * v
        rolled[i, 1] = delay * speeds[i, 1] + (dt - delay) * omega
        speeds[i, 0], speeds[i, 1] = v, omega
    return -1


@kernel
def read_bodies(which, bodies, chords, poses, velocities):
    """Write `poses` and `velocities` of robots `which`: see `DifferentialDrive`."""
    for i in which:
        angle = bodies[i, 2]
        poses[i, 0], poses[i, 1] = bodies[i, 0], bodies[i, 1]
        poses[i, 2] = angle - math.tau * np.rint(angle / math.tau)
        velocities[i, 0] = bodies[i, 3] * chords[i, 0] + bodies[i, 4] * chords[i, 1]
        velocities[i, 1] = bodies[i, 5]
