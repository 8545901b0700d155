"""`dynslam play`: drive the robot by keyboard, and watch the map grow."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass
class PlayCommand:
    """Drive a simulated robot by keyboard and watch the map grow.

    Arrows or WASD drive; H shows all keys.
    """

    env: str = "DoorCorridor-v0"
    """Id of the environment, such as DoorCorridor-v0, DoorOffice-v0 or DoorLoop-v0; or MODULE:ID of
    a world of your own, which MODULE registers."""
    slam: str = "dynamic-ml"
    """SLAM variant that maps during the drive; `none` for no SLAM."""
    seed: int = 0
    """Seed of the first episode."""
    world: Path | None = None
    """World file (JSON) that replaces the worlds of the environment."""

    def __call__(self) -> int:
        """Open a window and drive until it is closed."""
        from .game import play

        return play(self)
