"""Blacklist: targets that are not chosen again for a while."""

from __future__ import annotations

import math

SAME_TARGET_DISTANCE = 0.5  # m: targets no farther apart count as one
BLACKLIST_TIME = 60.0  # s, after which a target may be tried again: doors open
DOOR_REST_TIME = 8.0  # s for which a door just looked at is left out, even if seen in part only


class Blacklist:
    """Targets that could not be reached or showed nothing new, each with its expiry time."""

    def __init__(self) -> None:
        self._until: list[tuple[float, tuple[float, float]]] = []

    def add(
        self, target: tuple[float, float], time: float, duration: float = BLACKLIST_TIME
    ) -> None:
        """List `target`, m, from `time`, s, on for `duration` s."""
        self._until.append((time + duration, target))

    def holds(self, target: tuple[float, float], time: float) -> bool:
        """Whether a listed target is near `target`, m."""
        return any(
            time < until and math.dist(target, place) < SAME_TARGET_DISTANCE
            for until, place in self._until
        )
