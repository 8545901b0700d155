"""The option --clock, and what is told of a recording's clocks."""

from __future__ import annotations

import math
import sys
from typing import Any

from slam.episode import Episode
from slam.errors import InputError
from slam.preprocessing.clock import Clock, ClockEstimate, estimated_clock, with_clock

AUTO, NONE = "auto", "none"
STAMPS = {"begin": False, "end": True}
MAX_SECONDS = 10.0  # a larger offset is no lag, but the stamps of another clock


def parsed_clock(text: str) -> Clock | None:
    """The correction that the text of --clock names; None for auto. Raises InputError."""
    if text == AUTO:
        return None
    if text == NONE:
        return Clock()
    number, _, stamp = text.partition(",")
    try:
        seconds = float(number)
    except ValueError:
        seconds = math.nan
    if not abs(seconds) <= MAX_SECONDS or (stamp or "begin") not in STAMPS:
        raise InputError(
            f"--clock is auto, none, or SECONDS of the odometry's delay ({-MAX_SECONDS:g} to "
            f"{MAX_SECONDS:g}), alone or with ,begin or ,end, such as 0.2 or 0,end; got {text!r}"
        )
    return Clock(round(seconds, 6), STAMPS[stamp or "begin"])


def on_one_clock(episode: Episode, clock: Clock | None, name: str) -> Episode:
    """The episode with `clock` or, if None, with its estimate; tells a correction of the recording
    `name` on standard error."""
    if clock is not None:
        return with_clock(episode, clock)
    estimate = estimated_clock(episode)
    if estimate.clock != Clock():
        print(f"{name}: clock: {clock_in_words(estimate)} (--clock sets it)", file=sys.stderr)
    return with_clock(episode, estimate.clock)


def clock_in_words(estimate: ClockEstimate) -> str:
    """The estimate, how sure it is, and what is done with it."""
    if estimate.reason:
        return f"could not be told: {estimate.reason}"
    words = (
        f"the odometry is {abs(estimate.offset):.3f} s {'late' if estimate.offset > 0 else 'early'}"
    )
    words += f" (standard error {estimate.deviation:.3f} s), "
    words += "corrected by map and run" if estimate.significant else "too little to be corrected"
    if estimate.sweep:
        words += f"; stamps are of the {'end' if estimate.end else 'beginning'} of a sweep"
    return words


def plain_clock(estimate: ClockEstimate) -> dict[str, Any]:
    """The estimate in JSON."""
    offset, deviation = (
        value if math.isfinite(value) else None for value in (estimate.offset, estimate.deviation)
    )
    stamp = "end" if estimate.end else "begin"
    return {
        "offset_s": offset,
        "standard_error_s": deviation,
        "stamp": stamp if estimate.sweep and not estimate.reason else None,
        "corrected_s": estimate.clock.offset,
        "in_words": clock_in_words(estimate),
    }
