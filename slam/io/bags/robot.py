"""The robot of a ROS recording: its odometry, and the pose of its laser on it."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from slam.errors import InputError
from slam.geometry import Array, Pose2
from slam.io.bags.poses import ODOMETRY
from slam.io.bags.recorded_messages import RecordedMessages
from slam.io.bags.transforms import Transforms, plain, seen_from_above
from slam.io.one_line import one_line
from slam.io.warnings import WarningCounter
from slam.trajectory import Trajectory

BASES = ("base_link", "base_footprint")  # REP 105
NO_ODOMETRY = "none"  # in a SourceSelection
MIN_UPRIGHT = math.cos(math.radians(10.0))  # cosine of the tilt; beyond it, ranges are too long


class OdometrySource(NamedTuple):
    """The odometry of a recording.

    trajectory  None if there is no odometry
    base        the robot's frame, whose poses these are
    source      description of where it comes from; empty if there is none
    """

    trajectory: Trajectory | None
    base: str
    source: str


def odometry_of(
    recorded: RecordedMessages,
    tree: Transforms,
    topic: str | None,
    wanted: str | None,
    warnings: WarningCounter,
) -> OdometrySource:
    """The odometry of the topic, or of /tf: of the wanted frame, or of one above the laser whose
    name has "odom" in it. Raises InputError if the wanted one is missing."""
    laser = recorded.sweeps[0].frame
    if wanted == NO_ODOMETRY:
        return OdometrySource(None, _base(tree, laser, ""), "")
    if topic is not None:
        stamped = recorded.odometry
        if len(stamped.times):
            times, first = np.unique(stamped.times, return_index=True)
            base = _base(tree, laser, stamped.frame)
            return OdometrySource(Trajectory(times, stamped.poses[first]), base, topic)
        warnings.add(f"{topic}: no usable odometry", 1)
    chain = tree.ancestors(laser)
    if wanted is not None and wanted != topic and plain(wanted) not in chain[1:]:
        raise InputError(
            f"no odometry {wanted!r}: neither a topic of {ODOMETRY} nor a frame above the laser's "
            f"({one_line(' < '.join(chain))})"
        )
    found = [
        name
        for name in chain[1:]
        if name == plain(wanted or "") or (not wanted and "odom" in name.lower())
    ]
    for frame in found:
        base = chain[chain.index(frame) - 1]
        times = tree.times(frame, base)
        if len(times):
            poses = seen_from_above(*tree.at(frame, base, times))
            return OdometrySource(Trajectory(times, poses), base, f"/tf: {base} in {frame}")
    if wanted is not None:
        raise InputError(f"no odometry {wanted!r}: nothing moves in that frame")
    warnings.add("no odometry in it: the laser alone tells how the robot moved", 1)
    return OdometrySource(None, _base(tree, laser, ""), "")


def _base(tree: Transforms, laser: str, wanted: str) -> str:
    """The robot's frame: the wanted one, or that of a usual name, or the laser's own."""
    chain = tree.ancestors(laser)
    if wanted and tree.connected(wanted, laser):
        return wanted
    return next((name for name in chain if name in BASES), wanted or laser)


def mounts_of(
    tree: Transforms,
    base: str,
    laser: str,
    times: Array,
    mount: Pose2 | None,
    warnings: WarningCounter,
) -> tuple[list[Pose2], np.ndarray]:
    """The pose of the laser on the robot at each scan, and (n,) bool: whether it is upside down."""
    upright = np.zeros(len(times), dtype=np.bool_)
    if mount is not None:
        return [mount] * len(times), upright
    if not tree.connected(base, laser) or laser == base:
        if laser != base:
            warnings.add(
                f"nothing says where the laser ({laser or 'without a frame'}) stands on the robot "
                f"({base or 'without a frame'}): taken to be at its centre",
                1,
            )
        return [Pose2()] * len(times), upright
    at = times if len(tree.times(base, laser)) else times[:1]
    shift, turn = tree.at(base, laser, at)
    up = turn.apply([0.0, 0.0, 1.0])[:, 2]
    if np.abs(up).min() < MIN_UPRIGHT:
        angle = math.degrees(math.acos(np.abs(up).min()))
        warnings.add(f"the laser is tilted by {angle:.0f} degrees: walls will be misjudged", 1)
    mounts = [Pose2(*row) for row in seen_from_above(shift, turn).tolist()]
    if len(at) == 1:
        return mounts * len(times), np.repeat(up < 0, len(times))
    return mounts, up < 0
