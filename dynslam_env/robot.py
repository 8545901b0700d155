"""The robot's body and what its wheels can do: a Pioneer 3-DX by default."""

from __future__ import annotations

from dataclasses import dataclass

from slam.checked import positive


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
        wheel = abs(v) + abs(omega) * self.wheel_base / 2
        slower = min(1.0, self.max_speed / wheel) if wheel > 0 else 1.0
        return v * slower, omega * slower

    def accelerated(
        self, now: tuple[float, float], command: tuple[float, float], dt: float
    ) -> tuple[float, float]:
        """The velocity (m/s, rad/s) after `dt` s on the way from `now` to `command`."""
        dv, dw = self.acceleration * dt, self.turn_acceleration * dt
        (v0, w0), (v, w) = now, self.feasible(*command)
        v = v0 + min(max(v - v0, -dv), dv)
        w = w0 + min(max(w - w0, -dw), dw)
        return self.feasible(v, w)
