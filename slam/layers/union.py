"""One map of what several lasers of a robot saw, each at its own height.

A laser that looks over a table sees free floor where another, lower one sees its edge. Such a cell
does not change: it is occupied at one height. So the layers of each laser are made of its own scans
alone, and what stands by any of them stands.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from slam.grid import GridSpec
from slam.layers.classification import CHANGING, FREE, KEPT, STATIC, UNKNOWN
from slam.layers.doors import each_once
from slam.layers.layers import Layers

STRONGER = (UNKNOWN, FREE, CHANGING, KEPT, STATIC)  # the later class holds
SAME_DOOR = 0.5  # m between the middles of two finds of one door


def united(parts: Sequence[Layers]) -> Layers:
    """The layers of several lasers as one, on the grid that holds all of theirs.

    A cell has the strongest of its classes (STRONGER), with the reason and the times by the laser
    that saw it so; of doors found by several lasers the most probable is kept.
    """
    first, *others = parts
    if not others:
        return first
    spec = _around([part.spec for part in parts])
    whole = _blank(spec)
    rank = np.argsort(STRONGER).astype(np.uint8)  # of each class
    for part in parts:
        row, col = part.spec.row0 - spec.row0, part.spec.col0 - spec.col0
        at = slice(row, row + part.spec.rows), slice(col, col + part.spec.cols)
        stronger = rank[part.kind] > rank[whole.kind[at]]
        for name in ("kind", "reason", "occupied", "rate", "watched"):
            getattr(whole, name)[at][stronger] = getattr(part, name)[stronger]
    doors = tuple(each_once((door for part in parts for door in part.doors), SAME_DOOR))
    return Layers(spec, whole.kind, whole.reason, whole.occupied, whole.rate, whole.watched, doors)


def _around(specs: Sequence[GridSpec]) -> GridSpec:
    rows = [(one.row0, one.row0 + one.rows) for one in specs]
    cols = [(one.col0, one.col0 + one.cols) for one in specs]
    row0, col0 = min(a for a, _ in rows), min(a for a, _ in cols)
    height, width = max(b for _, b in rows) - row0, max(b for _, b in cols) - col0
    return GridSpec(specs[0].resolution, row0, col0, height, width)


def _blank(spec: GridSpec) -> Layers:
    kind, reason = np.zeros(spec.shape, np.uint8), np.zeros(spec.shape, np.uint8)
    rate, watched = np.zeros(spec.shape, np.float32), np.zeros(spec.shape, np.float32)
    return Layers(spec, kind, reason, np.full(spec.shape, np.nan, np.float32), rate, watched, ())
