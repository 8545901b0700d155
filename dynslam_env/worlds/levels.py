"""The ranges of the parameters of worlds at each difficulty."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np


class Range(NamedTuple):
    """A parameter is drawn uniformly from `low` to `high`; of whole numbers, both are included."""

    low: float
    high: float

    def draw(self, rng: np.random.Generator) -> float:
        """A value; an int where both ends are."""
        if isinstance(self.low, int) and isinstance(self.high, int):
            return int(rng.integers(self.low, self.high, endpoint=True))
        return rng.uniform(self.low, self.high)


Ranges = Mapping[str, Range]

CLUTTER: Mapping[str, Ranges] = {
    "easy": {},
    "medium": {"furniture": Range(0, 2), "narrowest": Range(0.8, 1.0), "cut": Range(0.0, 0.8)},
    "hard": {
        "furniture": Range(2, 4),
        "narrowest": Range(0.72, 0.9),
        "cut": Range(0.5, 1.2),
    },
}
"""Pieces per room, share of door_width, m: the same ranges in each kind of world."""

DOOR_WIDTHS = {"easy": Range(0.9, 1.0), "medium": Range(0.85, 1.1), "hard": Range(0.9, 1.2)}
"""m, of the widest door of a world."""

PEOPLE = {"easy": Range(0, 0), "medium": Range(0, 2), "hard": Range(2, 4)}
"""How many people are added to those of the world."""

SIZES: Mapping[str, Mapping[str, Ranges]] = {
    "corridor": {
        "easy": {"length": Range(9.0, 12.0), "width": Range(1.8, 2.4),
                 "doors_per_side": Range(2, 3), "room_depth": Range(2.5, 3.5)},
        "medium": {"length": Range(11.0, 15.0), "width": Range(1.7, 2.6),
                   "doors_per_side": Range(3, 5), "room_depth": Range(2.4, 4.0)},
        "hard": {"length": Range(14.0, 20.0), "width": Range(1.5, 3.0),
                 "doors_per_side": Range(5, 8), "room_depth": Range(2.4, 4.5)},
    },
    "loop": {
        "easy": {"length": Range(11.0, 14.0), "breadth": Range(9.0, 11.0), "width": Range(1.8, 2.2),
                 "outer_doors": Range(1, 2), "inner_doors": Range(0, 1)},
        "medium": {"length": Range(13.0, 17.0), "breadth": Range(10.0, 13.0),
                   "width": Range(1.7, 2.4), "outer_doors": Range(2, 4), "inner_doors": Range(1, 2),
                   "room_depth": Range(2.4, 4.0)},
        "hard": {"length": Range(16.0, 22.0), "breadth": Range(11.0, 15.0),
                 "width": Range(1.5, 2.6), "outer_doors": Range(3, 5), "inner_doors": Range(2, 4),
                 "room_depth": Range(2.4, 4.5)},
    },
    "office": {
        "easy": {"length": Range(10.0, 13.0), "breadth": Range(8.0, 10.0),
                 "room_side": Range(2.8, 3.4), "doors": Range(1, 3)},
        "medium": {"length": Range(13.0, 17.0), "breadth": Range(9.0, 12.0),
                   "room_side": Range(2.6, 3.2), "doors": Range(3, 5)},
        "hard": {"length": Range(17.0, 21.0), "breadth": Range(11.0, 14.0),
                 "room_side": Range(2.4, 3.0), "doors": Range(5, 8)},
    },
    "wings": {  # of each corridor
        "easy": {"length": Range(6.0, 9.0), "width": Range(1.8, 2.4),
                 "doors_per_side": Range(1, 2), "room_depth": Range(2.5, 3.5)},
        "medium": {"length": Range(7.0, 10.0), "width": Range(1.7, 2.6),
                   "doors_per_side": Range(2, 3), "room_depth": Range(2.4, 4.0)},
        "hard": {"length": Range(8.0, 12.0), "width": Range(1.5, 3.0),
                 "doors_per_side": Range(3, 4), "room_depth": Range(2.4, 4.5)},
    },
}  # fmt: skip
"""m, and numbers of doors, by kind of world and difficulty."""

WING_COUNTS = {"easy": Range(2, 2), "medium": Range(2, 3), "hard": Range(3, 4)}
"""How many corridors a building of wings has."""
