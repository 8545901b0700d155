# pyright: reportMissingImports=false
"""Runs yag_slam on a table of scans: `python yag_slam_driver.py LOG.csv TRAJECTORY.tum`.

Imports nothing of dynslam: yag_slam is installed in an environment of its own. Its settings, where
they differ from its defaults, were chosen on seeds 1000 and 1001: see docs/rivals.md.
"""

from __future__ import annotations

import math
import sys
from typing import Any

import numpy as np
from scan_table import ScanTable, read_table  # beside this file

KEYFRAME_DISTANCE = 0.2  # m
KEYFRAME_TURN = math.radians(10.0)
MATCHER = {"search_size": 0.3, "smear_deviation": 0.03}  # m; defaults 0.5 and 0.05
LOOP_MATCHER = {"search_size": 1.5}  # m; default 4
LOOP_RESPONSES = {"min_response_coarse": 0.7, "min_response_fine": 0.8}  # defaults 0.35 and 0.45


def keyframes(poses: np.ndarray) -> list[int]:
    """The first and the last scan, and those after which the robot has moved or turned enough."""
    chosen = [0]
    for k, (x, y, theta) in enumerate(poses):
        x0, y0, theta0 = poses[chosen[-1]]
        turn = abs(math.remainder(theta - theta0, 2 * math.pi))
        if math.hypot(x - x0, y - y0) >= KEYFRAME_DISTANCE or turn >= KEYFRAME_TURN:
            chosen.append(k)
    return list(dict.fromkeys([*chosen, len(poses) - 1]))


def mapped(table: ScanTable, chosen: list[int]) -> Any:
    """The SLAM after the chosen scans."""
    from yag_slam.graph_slam import GraphSlam
    from yag_slam.models import LocalizedRangeScan
    from yag_slam.scan_matching import Scan2DMatcherCpp

    first, step = table.head["angle_min"][0], table.head["angle_increment"][0]
    near, far = max(table.head["range_min"][0], 0.01), table.head["range_max"][0]
    mount_x, mount_y, mount_turn = table.head["mount"]
    if mount_x or mount_y:
        sys.exit("yag_slam has no laser off the robot's centre")
    matcher = Scan2DMatcherCpp({**MATCHER, "range_threshold": far})
    loop_matcher = Scan2DMatcherCpp(LOOP_MATCHER, loop=True)
    # verbose: without it, a loop whose fine match is poor is closed all the same (0.3.0)
    slam = GraphSlam(matcher, loop_matcher, verbose=True, **LOOP_RESPONSES)
    low = first + mount_turn
    high = low + step * (table.ranges.shape[1] - 1)
    for k in chosen:
        ranges = np.where(table.ranges[k] < far, table.ranges[k], far + 1.0)  # no echo, no reading
        pose = table.poses[k].tolist()
        slam.process_scan(LocalizedRangeScan(ranges, low, high, step, near, far, far, *pose))
    return slam


def main(log: str, out: str) -> None:
    """Read, map, write."""
    table = read_table(log)
    chosen = keyframes(table.poses)
    slam = mapped(table, chosen)
    with open(out, "w", encoding="utf-8") as file:
        for time, vertex in zip(table.times[chosen].tolist(), slam.graph.vertices, strict=True):
            pose = vertex.obj.corrected_pose
            half = pose.euler[-1] / 2
            file.write(f"{time!r} {pose.x} {pose.y} 0 0 0 {math.sin(half)} {math.cos(half)}\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
