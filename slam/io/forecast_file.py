"""Forecasts of doors as .npz files of plain numbers."""

from __future__ import annotations

import math
import os
from typing import Any

import numpy as np

from slam.errors import InputError
from slam.forecast.door import DoorForecast, Look
from slam.forecast.watched import UNKNOWN
from slam.io.arrays import floats, numbers, parsed
from slam.io.files import replacing

FORMAT = "dynslam-door-forecast-1"
WHAT = "a forecast saved by dynslam"
NOTHING = math.nan  # in the place of a time or a day that is not there


def save_forecast(door: DoorForecast, path: str | os.PathLike[str]) -> None:
    """Write `door` to `path` (.npz) atomically. Raises InputError if it cannot be written."""
    with replacing(path) as file:
        np.savez_compressed(file, format=FORMAT, **packed_forecast(door))


def packed_forecast(door: DoorForecast) -> dict[str, Any]:
    """All that a forecast has learned, as arrays by name."""
    arrays: dict[str, Any] = {
        "timezone": door.clock.name,
        "half_life_days": door.half_life_days,
        "days": [_or_nothing(door.reference), _or_nothing(door.rates_day)],
        "rates": door.known_rates,
        "estimates": door.estimates,
        "watched_hours": door.watched_hours,
        "last_minute": _or_nothing(door.window.last),
        "window_state": door.window.state,
        "window_age": door.window.age,
        "look": [] if door.look is None else [*door.look[:2], _or_nothing(door.look.since)],
    }
    return arrays | door.sums()


def load_forecast(path: str | os.PathLike[str]) -> DoorForecast:
    """Read a file of `save_forecast`. Raises InputError for any other; never runs a pickle."""
    return parsed(path, WHAT, FORMAT, unpacked_forecast)


def unpacked_forecast(data: dict[str, Any]) -> DoorForecast:
    """The forecast of such arrays. Raises InputError, KeyError, ValueError or TypeError for
    others."""
    door = DoorForecast(str(data["timezone"]), float(data["half_life_days"]))
    for name, sums in door.sums().items():
        sums[...] = _like(sums, data, name)
    door.reference, door.rates_day = map(_whole, numbers(data["days"], (2,)).tolist())
    door.known_rates = _like(door.known_rates, data, "rates")
    door.estimates = _like(door.estimates, data, "estimates")
    door.watched_hours = _like(door.watched_hours, data, "watched_hours")
    door.window.last = _whole(float(data["last_minute"]))
    door.window.state = _whole_like(door.window.state, data, "window_state", 1)
    door.window.age = _whole_like(door.window.age, data, "window_age", 2**40)
    look = data["look"]
    door.look = _look(*numbers(look, (3,)).tolist()) if np.size(look) else None
    return door


def _like(known: np.ndarray, data: dict[str, Any], name: str) -> np.ndarray:
    """The array `name`, finite and of the shape of `known`."""
    array = floats(data[name], known.ndim)
    if array.shape != known.shape or not np.isfinite(array).all():
        raise InputError(f"{name} must be finite numbers of shape {known.shape}")
    return array


def _whole_like(known: np.ndarray, data: dict[str, Any], name: str, most: int) -> np.ndarray:
    array = _like(known, data, name)
    if not ((array >= UNKNOWN) & (array <= most) & (array == np.rint(array))).all():
        raise InputError(f"{name} must be whole numbers from {UNKNOWN} to {most}")
    return array.astype(known.dtype)


def _look(time: float, state: float, since: float) -> Look:
    if state not in (0.0, 1.0) or not math.isfinite(time) or math.isinf(since):
        raise InputError("look must have a time, a state of 0 or 1, and a time since when")
    return Look(time, int(state), None if math.isnan(since) else since)


def _or_nothing(value: float | None) -> float:
    return NOTHING if value is None else float(value)


def _whole(value: float) -> int | None:
    return None if math.isnan(value) else int(value)
