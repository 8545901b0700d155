"""The probability that a gap in a wall is a door, by its shape and by what was seen of it."""

from __future__ import annotations

import math
from typing import NamedTuple

from slam.layers.door_looks import Looks
from slam.layers.gap_shape import GapShape

SET_BACK = 0.03, 0.18  # m, of a closed leaf behind the face of its wall
ENOUGH = 31  # scans in a row that saw it open, and as many closed: more do not tell more
USUAL_WIDTH, UNUSUAL = (0.75, 1.1), 0.2  # m, of doors; and of the unit of what is beyond


class Evidence(NamedTuple):
    """What tells a door from other gaps: numbers from 0 to 1, but `odd`.

    flank    share of the wall beside it that lies in one line
    front    share of the area before it that is free
    swung    a straight leaf was seen in it, and it was seen open: the logarithm of the scans in a
             row that saw it so, whichever are fewer
    shut     a straight leaf stands in it, set back from the face of the wall, and nothing was seen
             behind it
    leaf     it is free, and so is what is behind it, and an open leaf stands beside it
    odd      how much narrower or wider it is than doors are, by UNUSUAL
    """

    flank: float
    front: float
    swung: float
    shut: float
    leaf: float
    odd: float


BIAS = -25.7  # nats; with the weights by a logistic regression: see docs/doors.md
WEIGHTS = Evidence(7.7, 17.1, 7.2, 6.4, 4.0, -6.9)


def evidence(width: float, shape: GapShape, looks: Looks) -> Evidence:
    """The evidence of a gap of `width`, m."""
    low, high = SET_BACK
    shut = shape.cover**2 * (1 - shape.beyond) if low <= shape.depth <= high else 0.0
    opening = shape.beyond * (1 - shape.blocked)
    both = min(looks.row_open, looks.row_closed, ENOUGH)
    swung = shape.cover * math.log1p(both) / math.log1p(ENOUGH)
    odd = max(USUAL_WIDTH[0] - width, width - USUAL_WIDTH[1], 0.0) / UNUSUAL
    return Evidence(
        shape.flank, shape.front, swung, shut, opening * shape.leaf**2, odd
    )  # fmt: skip


def probability(told: Evidence) -> float:
    """The probability that it is a door."""
    nats = BIAS + sum(w * e for w, e in zip(WEIGHTS, told, strict=True))
    return 1.0 / (1.0 + math.exp(-nats))
