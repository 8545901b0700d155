"""Files of relations (Kuemmerle et al. 2009): `t1 t2 x y z roll pitch yaw`, one a line."""

from __future__ import annotations

import numpy as np

from slam.errors import InputError
from slam.io.files import AnyPath
from slam.io.number_columns import read_columns
from slam.metrics.relations import Relations

COLUMNS = "t1 t2 x y z roll pitch yaw"


def read_relations(path: AnyPath) -> Relations:
    """Read relations in the plane: z, roll and pitch are not used. Raises InputError."""
    rows, _ = read_columns(path, COLUMNS)
    if not len(rows):
        raise InputError(f"{path}: no relation in it, expected lines of `{COLUMNS}`")
    return Relations(rows[:, 0], rows[:, 1], np.ascontiguousarray(rows[:, [2, 3, 7]]))
