"""Runs yag_slam on a table of scans: `python yag_slam_driver.py LOG.csv TRAJECTORY.tum`.

Imports nothing of dynslam: yag_slam is installed in an environment of its own. Matchers with the
defaults of yag_slam; a keyframe every 0.2 m or 10 degrees.
"""

from __future__ import annotations

import csv
import math
import sys
from typing import Any

import numpy as np

KEYFRAME_DISTANCE = 0.2  # m
KEYFRAME_TURN = math.radians(10.0)


def read_table(path: str) -> tuple[dict[str, list[float]], np.ndarray]:
    """The numbers of the head by name, and the rows: time, x, y, theta, ranges."""
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
    return head, table[~np.isnan(table[:, 4:]).all(axis=1)]


def keyframes(poses: np.ndarray) -> list[int]:
    """Numbers of the scans that the robot has moved or turned enough for; the first and the last."""
    chosen = [0]
    for k, (x, y, theta) in enumerate(poses):
        x0, y0, theta0 = poses[chosen[-1]]
        turn = abs(math.remainder(theta - theta0, 2 * math.pi))
        if math.hypot(x - x0, y - y0) >= KEYFRAME_DISTANCE or turn >= KEYFRAME_TURN:
            chosen.append(k)
    return list(dict.fromkeys([*chosen, len(poses) - 1]))


def mapped(head: dict[str, list[float]], rows: np.ndarray) -> Any:
    """The SLAM after all rows."""
    from yag_slam.graph_slam import GraphSlam
    from yag_slam.models import LocalizedRangeScan
    from yag_slam.scan_matching import Scan2DMatcherCpp

    first, step = head["angle_min"][0], head["angle_increment"][0]
    near, far = max(head["range_min"][0], 0.01), head["range_max"][0]
    mount_x, mount_y, mount_turn = head["mount"]
    if mount_x or mount_y:
        sys.exit("yag_slam has no laser off the robot's centre")
    slam = GraphSlam(Scan2DMatcherCpp({}), Scan2DMatcherCpp({}, loop=True), verbose=True)
    for row in rows:
        ranges = np.where(np.isfinite(row[4:]) & (row[4:] < far), row[4:], far + 1.0)
        low = first + mount_turn
        scan = LocalizedRangeScan(
            ranges, low, low + step * (len(ranges) - 1), step, near, far, far, *row[1:4]
        )
        slam.process_scan(scan)
    return slam


def main(log: str, out: str) -> None:
    """Read, map, write."""
    head, rows = read_table(log)
    rows = rows[keyframes(rows[:, 1:4])]
    slam = mapped(head, rows)
    with open(out, "w", encoding="utf-8") as file:
        for row, vertex in zip(rows, slam.graph.vertices, strict=True):
            pose = vertex.obj.corrected_pose
            half = pose.euler[-1] / 2
            file.write(
                f"{float(row[0])!r} {pose.x} {pose.y} 0 0 0 {math.sin(half)} {math.cos(half)}\n"
            )


if __name__ == "__main__":
    main(*sys.argv[1:])
