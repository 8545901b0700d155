"""Reads the table of scans that dynslam writes for an outside system; needs numpy alone."""

from __future__ import annotations

import csv
from typing import NamedTuple

import numpy as np


class ScanTable(NamedTuple):
    """Scans of a laser whose beams are evenly spread.

    head    numbers by name: angle_min and angle_increment (rad), range_min, range_max (m), mount
            (x, y, theta of the laser on the robot; m, rad)
    times   (n,) s
    poses   (n, 3) of the odometry, m and rad
    ranges  (n, beams) m; inf is no echo, NaN no reading
    """

    head: dict[str, list[float]]
    times: np.ndarray
    poses: np.ndarray
    ranges: np.ndarray


def read_table(path: str) -> ScanTable:
    """The rows with a scan; those with an odometry pose alone are left out."""
    head: dict[str, list[float]] = {}
    rows = []
    with open(path, encoding="utf-8", newline="") as file:
        for row in csv.reader(file):
            if row[0].startswith("#"):
                name, _, value = row[0][1:].partition(":")
                head[name.strip()] = [float(word) for word in value.split()]
            elif row[0] != "time":
                rows.append([float(word or "nan") for word in row])
    table = np.array(rows)
    table = table[~np.isnan(table[:, 4:]).all(axis=1)]
    return ScanTable(head, table[:, 0], table[:, 1:4], table[:, 4:])
