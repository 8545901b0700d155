"""`dynslam warm-up`: compiles the kernels, so that no later command waits for it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass
class WarmUpCommand:
    """Compile the kernels of worlds and SLAM variants now, once after an installation.

    Every command compiles what it needs when it needs it. This one compiles all kernels at once, in
    several processes: for an image of a container, or before something is timed. What is
    compiled already takes a few seconds.
    """

    variants: str = "all"
    """SLAM variants, separated by commas; or all; or plain: those without a slash."""
    jobs: int = -1
    """Number of processes; -1: one per core."""

    def __call__(self) -> int:
        """Compile; the exit status is 1 if something failed."""
        from .compile_kernels import compile_kernels

        return compile_kernels(self)
