"""Values that are too large to be usual, where some recordings have many that mean nothing."""

from __future__ import annotations

MEMORY = 300  # values over which dismissed ones are forgotten
RATE = 0.2  # at which the level of the dismissed ones is learned


class Surprise:
    """Tells surprising values: those above a threshold, and above the mean of the dismissed ones.

    A value is dismissed when the search that it led to found nothing. Its memory fades, so that a
    recording in which large values are common leads to few searches.
    """

    def __init__(self, threshold: float):
        self._threshold = threshold
        self._surprising = self._dismissed = 0.0

    def surprising(self, value: float, usual: float = 0.0) -> bool:
        """Whether the next value is surprising, where `usual` ones are not."""
        result = value > max(self._threshold, usual, self._dismissed)
        if result:
            self._surprising = value
        self._dismissed *= 1.0 - 1.0 / MEMORY
        return result

    def dismiss(self) -> None:
        """The latest surprising value meant nothing."""
        self._dismissed += RATE * max(self._surprising - self._dismissed, 0.0)
