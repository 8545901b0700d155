"""Checks of the `options` of a reset."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slam.errors import InputError
from slam.geometry import Pose2
from slam.validation import finite, instance, one_of

Bools = NDArray[np.bool_]


def start_of(options: Mapping[str, Any] | None) -> Pose2 | None:
    """The start pose of the options, if given; raises InputError for invalid options."""
    given = _copied(options)
    for name in given:
        one_of("an option of reset", name, ("start",))
    start = given.get("start")
    if start is None:
        return None
    finite("options['start']", start)
    if np.shape(start) != (3,):
        raise InputError(
            f"options['start'] must be three numbers x, y in m, theta in rad, got {start!r}"
        )
    return Pose2.of(start)


def reset_mask(options: Mapping[str, Any] | None, n: int) -> tuple[Bools, dict[str, Any]]:
    """The mask (n,) of the worlds to reset (default: all), and the other options."""
    others = _copied(options)
    mask = others.pop("reset_mask", np.ones(n, dtype=np.bool_))
    if not (isinstance(mask, np.ndarray) and mask.dtype == np.bool_ and mask.shape == (n,)):
        raise InputError(f"options['reset_mask'] must be a bool array of shape ({n},), got {mask}")
    if not mask.any():
        raise InputError("options['reset_mask'] must name at least one world, got none")
    return mask, others


def _copied(options: Mapping[str, Any] | None) -> dict[str, Any]:
    """A copy of the options, empty for None."""
    given = {} if options is None else options
    instance("the options of reset", given, Mapping)
    return dict(given)
