"""Blacklist: places that are not to be gone to for a while."""

from __future__ import annotations

import math

SAME = 0.5  # m: targets no farther apart are the same
FORGET = 60.0  # s, after which a place on the blacklist may be tried again: doors open
LOOKED = 8.0  # s for which a door just looked at is left alone, even if little of it was seen


class Blacklist:
    """Places that could not be reached, or that showed nothing new, for a while."""

    def __init__(self) -> None:
        self._until: list[tuple[float, tuple[float, float]]] = []

    def add(self, target: tuple[float, float], time: float, forget: float = FORGET) -> None:
        """From `time`, s, on, for `forget` s."""
        self._until.append((time + forget, target))

    def holds(self, target: tuple[float, float], time: float) -> bool:
        """Whether `target`, m, is near one of them."""
        return any(time < until and math.dist(target, place) < SAME for until, place in self._until)
