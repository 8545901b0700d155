"""Lasers that are upside down or do not turn with the robot: corrected, refused, or told."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

from slam.episode import Episode
from slam.errors import InputError
from slam.preprocessing.laser_sense import Sense, sense_of, turned_over


def turned_upright(lasers: Sequence[Episode], file: Path) -> tuple[list[Episode], tuple[str, ...]]:
    """The episodes with each laser upright, and what was wrong, which is told on standard error.

    One laser that sees the world mirrored is turned over. One of several that does not turn with
    the robot is refused (InputError); a single one is told only, since the odometry may be wrong.
    """
    upright, told = [], []
    for one in lasers:
        sense = sense_of(one)
        name = one.meta.get("laser") or "the laser"
        if sense is Sense.STILL and len(lasers) > 1:
            raise InputError(
                f"{file}: {name} does not turn with the robot: it repeats old scans, or is not on "
                f"the robot; leave it out (--laser)"
            )
        if sense is Sense.STILL:
            told.append(f"{name} does not turn with the odometry: one of the two is wrong")
        if sense is Sense.MIRRORED:
            told.append(f"{name} turns against the robot: taken to be upside down, and turned over")
            one = turned_over(one)
        upright.append(one)
    for words in told:
        print(f"{file}: warning: {words}", file=sys.stderr)
    return upright, tuple(told)
