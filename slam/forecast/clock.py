"""The minute of the week that a building's clock shows at a unix time."""

from __future__ import annotations

from datetime import UTC, datetime
from zoneinfo import ZoneInfo

import numpy as np

from slam.errors import InputError
from slam.geometry import Array

UTC_NAME = "UTC"  # known without a data base of time zones
MINUTE, DAY_MINUTES = 60, 1440  # s; min
WEEK_MINUTES = 7 * DAY_MINUTES
MONDAY = 3 * DAY_MINUTES  # min from the beginning of the week to 1970-01-01, a Thursday
OFFSET_STEP = 15 * MINUTE  # s; no time zone changes its offset more finely
EARLIEST, LATEST = -2.2e9, 7.2e9  # s, unix time: the years 1900 to 2198


class WeekClock:
    """The local clock of a time zone.

    name  of the IANA data base, such as "Europe/London". With "UTC" the week is only shifted, as
          long as the building's clock is never changed. Daylight saving time changes it: habits
          then come an hour early or late.
    """

    def __init__(self, name: str) -> None:
        try:
            self._zone = UTC if name == UTC_NAME else ZoneInfo(name)
        except (OSError, ValueError, TypeError, KeyError):
            raise InputError(
                f'timezone must be a name such as "UTC" or "Europe/London", got {name!r}'
            ) from None
        self.name = name

    def minute_of_week(self, times: Array) -> np.ndarray:
        """Minutes since Monday 0:00 of the local clock, of unix times in s (any shape), rounded
        down."""
        local = np.floor((times + self._offsets(times)) / MINUTE).astype(np.int64)
        return (local + MONDAY) % WEEK_MINUTES

    def _offsets(self, times: Array) -> Array:
        if self.name == UTC_NAME:
            return np.zeros_like(times)
        steps, place = np.unique(np.floor(times / OFFSET_STEP), return_inverse=True)
        offsets = np.array([self._offset(step * OFFSET_STEP) for step in steps.tolist()])
        return offsets[place].reshape(np.shape(times))

    def _offset(self, time: float) -> float:
        offset = datetime.fromtimestamp(time, self._zone).utcoffset()
        return 0.0 if offset is None else offset.total_seconds()
