"""Windows of time: what the maps that count them cut it into."""

from __future__ import annotations

from slam.checked import positive_number


class Windows:
    """Windows of `delta_t` s, numbered from the first time that is asked for."""

    def __init__(self, delta_t: float):
        positive_number("delta_t", delta_t)
        self._delta_t = delta_t
        self._start: float | None = None

    def at(self, time: float) -> int:
        """Number of the window of `time`, s; below zero where the clock runs back."""
        if self._start is None:
            self._start = time
        return int((time - self._start) // self._delta_t)
