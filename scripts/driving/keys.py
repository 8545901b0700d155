"""Meaning of the keys, by pygame's names, and driving with held keys."""

from __future__ import annotations

from collections.abc import Set
from typing import NamedTuple

from dynslam_env import Robot

AHEAD, BACK = frozenset({"up", "w"}), frozenset({"down", "s"})
LEFT, RIGHT = frozenset({"left", "a"}), frozenset({"right", "d"})
STOP = frozenset({"space"})
TURN_RATE = 1.2  # rad/s, while a key is held
MIN_SPEED = 0.02  # m/s; a slower robot counts as standing

KEY_COMMANDS = {
    "+": "closer", "=": "closer", "[+]": "closer", "-": "farther", "[-]": "farther",
    "f": "follow", "m": "map", "r": "new", "p": "pause", "h": "help", "f1": "help",
    "q": "quit", "escape": "quit",
}  # fmt: skip
"""Commands by key; the other keys drive while they are held."""

HELP = (
    ("up, W", "faster; the speed is kept"),
    ("down, S", "slower, then backwards"),
    ("left, right, A, D", "turn"),
    ("space", "stop"),
    ("+  -", "closer, farther"),
    ("F", "follow the robot, or stay"),
    ("M", "map on, off"),
    ("R", "a new episode"),
    ("P", "pause"),
    ("H, F1", "this help on, off"),
    ("Q, Esc", "quit"),
)
"""Keys and their meaning."""

KEY_LINE = (
    "arrows drive   space stop   + - zoom   F follow   M map   R new   P pause   H help   Q quit"
)


class DriveCommand(NamedTuple):
    """The driver's command.

    speed  m/s, forward
    turn   rad/s
    kept   m/s, the speed without a key
    """

    speed: float = 0.0
    turn: float = 0.0
    kept: float = 0.0

    def action(self, robot: Robot) -> tuple[float, float]:
        """Action of the environment, normalised by the robot's limits."""
        return self.speed / robot.max_speed, self.turn / robot.max_turn


def drive(held: Set[str], before: DriveCommand, speed: float, robot: Robot) -> DriveCommand:
    """The command while keys are `held`; `speed` of the robot now, m/s.

    The robot accelerates as long as a key is held.
    """
    turn = TURN_RATE * (bool(LEFT & held) - bool(RIGHT & held))
    ahead = bool(AHEAD & held) - bool(BACK & held)
    if STOP & held:
        return DriveCommand(0.0, turn, 0.0)
    if ahead:
        return DriveCommand(ahead * robot.max_speed, turn, speed if abs(speed) > MIN_SPEED else 0.0)
    return DriveCommand(before.kept, turn, before.kept)
