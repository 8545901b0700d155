"""What keys mean, by the names that pygame gives them, and how those that are held drive."""

from __future__ import annotations

from collections.abc import Set
from typing import NamedTuple

from dynslam_env import Robot

AHEAD, BACK = frozenset({"up", "w"}), frozenset({"down", "s"})
LEFT, RIGHT = frozenset({"left", "a"}), frozenset({"right", "d"})
STOP = frozenset({"space"})
TURN = 1.2  # rad/s, while a key is held
STILL = 0.02  # m/s, slower than that is standing

COMMANDS = {
    "+": "closer", "=": "closer", "[+]": "closer", "-": "farther", "[-]": "farther",
    "f": "follow", "m": "map", "r": "new", "p": "pause", "h": "help", "f1": "help",
    "q": "quit", "escape": "quit",
}  # fmt: skip
"""What a key does when it is pressed; the others drive while they are held."""

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
"""Key, meaning."""

LINE = "arrows drive   space stop   + - zoom   F follow   M map   R new   P pause   H help   Q quit"


class DriveCommand(NamedTuple):
    """What the driver wants.

    speed  m/s, forward
    turn   rad/s
    kept   m/s, the speed that is held when no key is
    """

    speed: float = 0.0
    turn: float = 0.0
    kept: float = 0.0

    def action(self, robot: Robot) -> tuple[float, float]:
        """The environment's, normalised by the robot's limits."""
        return self.speed / robot.max_speed, self.turn / robot.max_turn


def drive(held: Set[str], before: DriveCommand, speed: float, robot: Robot) -> DriveCommand:
    """What is wanted while keys are `held`; `speed` is the robot's now, m/s.

    The robot's own acceleration makes it faster for as long as a key is held.
    """
    turn = TURN * (bool(LEFT & held) - bool(RIGHT & held))
    ahead = bool(AHEAD & held) - bool(BACK & held)
    if STOP & held:
        return DriveCommand(0.0, turn, 0.0)
    if ahead:
        return DriveCommand(ahead * robot.max_speed, turn, speed if abs(speed) > STILL else 0.0)
    return DriveCommand(before.kept, turn, before.kept)
