"""`dynslam speed`: cost of an environment step and of a SLAM's scan, in time and memory."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass
class SpeedCommand:
    """Measure processor time and memory of the environment and of SLAM variants.

    Each is measured beside a yardstick. The default takes about a minute of a free core.

    env: ten physics steps (the floor), one environment, the vector environment, resets.
    slam: a matched scan of each variant on a drive past moving doors, and on a log.
    memory: bytes of each variant's map over time in one place (on request; a minute).
    patrol: time of the parts of a step of DoorPatrol-v0, and of learning (on request).
    building: bytes of each variant's map of 200 x 200 m (on request; half a minute each).
    long: cost, memory and error of each variant over 100,000 scans (on request; minutes each).
    """

    what: str = "env,slam"
    """Measurements: env, slam, memory, patrol, building, long, separated by commas, or all."""
    variants: str = "plain"
    """SLAM variants to measure, separated by commas; or all; or plain: those without a slash."""
    log: Path | None = None
    """Recording to measure the SLAM variants on, too."""
    json: bool = False
    """Print one JSON object instead of tables."""
    num_envs: int = 64
    """Number of worlds of the vector environment."""
    rounds: int = 9
    """Rounds of each measurement of env; a ninth as many of slam. The fastest counts."""

    def __call__(self) -> int:
        """Measure and print."""
        from .measurements import measure

        return measure(self)
