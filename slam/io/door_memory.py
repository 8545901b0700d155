"""What is remembered of a door from visit to visit, as arrays for saving."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from slam.errors import InputError
from slam.forecast.door import DoorForecast
from slam.io.arrays import floats
from slam.io.forecast_file import packed_forecast, unpacked_forecast
from slam.io.guard import RECORD_BYTES, take
from slam.io.layers import packed_doors as rows_of
from slam.io.layers import unpacked_door
from slam.layers.doors import MappedDoor

DOORS, UNTIL = "doors", "doors_until"  # names of the arrays; those of door k: doorK_NAME


class RememberedDoor(NamedTuple):
    """A door of a building.

    door      as it was mapped last
    forecast  its habits, learned from all that was seen of it; state 1 is open
    until     s, unix time, up to which the recordings were learned from; -inf: none was
    """

    door: MappedDoor
    forecast: DoorForecast
    until: float


def packed_doors(doors: Sequence[RememberedDoor]) -> dict[str, np.ndarray]:
    """Doors as arrays by name, without any loss."""
    arrays = {DOORS: rows_of([one.door for one in doors])}
    arrays[UNTIL] = np.array([one.until for one in doors])
    for k, one in enumerate(doors):
        packed = packed_forecast(one.forecast)
        arrays |= {f"door{k}_{name}": np.asarray(array) for name, array in packed.items()}
    return arrays


def unpacked_doors(data: dict[str, Any]) -> tuple[RememberedDoor, ...]:
    """The doors of such arrays; none of a file without them. Raises InputError, KeyError,
    ValueError or TypeError for others."""
    if DOORS not in data:
        return ()
    doors, until = floats(data[DOORS], 2), floats(data[UNTIL], 1)
    take(RECORD_BYTES * len(doors))
    if len(doors) != len(until) or not np.isfinite(doors).all() or np.isnan(until).any():
        raise InputError("each door needs finite numbers and a time")
    widths = np.hypot(*(doors[:, 2:4] - doors[:, :2]).T)
    if not (np.isin(doors[:, -2:], (-1, 0, 1)).all() and (widths > 0).all()):
        raise InputError("a door has a width, a hinge at one of its ends, and opens to one side")
    return tuple(
        RememberedDoor(unpacked_door(row), unpacked_forecast(_of_door(data, k)), time)
        for k, (row, time) in enumerate(zip(doors.tolist(), until.tolist(), strict=True))
    )


def _of_door(data: dict[str, Any], number: int) -> dict[str, Any]:
    prefix = f"door{number}_"
    return {name.removeprefix(prefix): data[name] for name in data if name.startswith(prefix)}
