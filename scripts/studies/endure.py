"""`dynslam endure`: random drives through every world, checked for what must never happen."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass
class EndureCommand:
    """Drive at random through all worlds; report NaNs, escapes, memory growth, slow steps.

    The exit status is 1 if anything was found.
    """

    steps: int = 1_000_000
    """Number of steps, over all worlds together."""
    seed: int = 0
    """Seed of the actions and of the first episode of each world."""
    json: bool = False
    """Print one JSON object instead of a table."""

    def __call__(self) -> int:
        """Drive, print."""
        from .random_drives import run_random_drives

        return run_random_drives(self)
