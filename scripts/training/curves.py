"""`dynslam curves`: learning curves of several trainings, with their interval."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import tyro


@dataclass
class CurvesCommand:
    """Draw the learning curves of several trainings and their interquartile mean.

    Each training is a thin line; the mean has a bootstrap 95 % interval (Agarwal et al. 2021).
    """

    folders: tyro.conf.Positional[tuple[Path, ...]]
    """Directories of `dynslam train`: trainings that differ in the seed."""
    out: Path = Path("curves.png")
    """The picture."""

    def __call__(self) -> int:
        """Read the trainings, draw the picture, print the final scores."""
        from .learning_curves import draw_curves

        return draw_curves(self)
