"""The file with the probability of being lost at each scan of a run."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from slam.io.files import replacing

from ..figures.lost_course import LostCourse

NAME = "lost.csv"


def write_lost(course: LostCourse, folder: Path) -> list[str]:
    """Write lost.csv: `time` of the scan, s, as in trajectory.tum, and `lost`; one scan a line.

    Returns the names of the files written: none from a SLAM that does not judge it.
    """
    if not course.judged:
        return []
    with replacing(folder / NAME) as file:
        file.write(b"time,lost\n")
        for time, probability in zip(course.times, course.probability, strict=True):
            stamp = np.format_float_positional(time, unique=True, min_digits=6)
            file.write(f"{stamp},{probability:.6g}\n".encode())
    return [NAME]
