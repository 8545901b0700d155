"""The messages of a ROS recording that an episode is made of: one laser, one odometry, all
transforms, with the stamps of one clock."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from slam.io.bags.bag import Bag
from slam.io.bags.laser_scan import Sweep, sweep
from slam.io.bags.poses import Poses, Stamped, stamp
from slam.io.bags.transforms import Transforms, plain
from slam.io.guard import RECORD_BYTES, SCAN_BYTES, take
from slam.io.warnings import WarningCounter

FRAMES = ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage")
COPIES = 4  # of float64 ranges: as they are read, in the scan, and what is computed from them
MAX_STEP_BACK = 1.0  # s: stamps that run back by more are not used


class StampedTransform(NamedTuple):
    """One transform of /tf or /tf_static.

    received  s, when it was recorded
    time      s, its stamp
    parent    frame in which the transform is given
    child     frame whose pose it gives
    row       x, y, z in m and quaternion x, y, z, w
    static    whether it is of /tf_static
    """

    received: float
    time: float
    parent: str
    child: str
    row: tuple[float, ...]
    static: bool


class RecordedMessages(NamedTuple):
    """Messages of a recording, in the order in which they were recorded."""

    sweeps: list[Sweep]
    odometry: Stamped
    frames: list[StampedTransform]


def read_messages(
    bag: Bag, laser: str, topic: str | None, warnings: WarningCounter
) -> RecordedMessages:
    """Read the messages of one laser, of the odometry's topic if there is one, and all frames."""
    sweeps: list[Sweep] = []
    poses = Poses()
    frames: list[StampedTransform] = []
    names = [laser, *([topic] if topic else []), *bag.named(*FRAMES)]
    for number, (name, received, message) in enumerate(bag.messages(names), 1):
        if name == laser:
            take(COPIES * 8 * len(message.ranges) + SCAN_BYTES)
            one = sweep(received, message)
            if one is None:
                warnings.add("scan without beams or without angles, left out", number)
            else:
                sweeps.append(one)
        elif name == topic:
            take(RECORD_BYTES)
            if not poses.add(received, message):
                warnings.add("odometry that is no pose, left out", number)
        else:
            static = "static" in name
            take(RECORD_BYTES * len(message.transforms))
            frames += [_frame(received, each, static) for each in message.transforms]
    return RecordedMessages(sweeps, poses.collected(), frames)


def _frame(received: float, message: Any, static: bool) -> StampedTransform:
    at, turn = message.transform.translation, message.transform.rotation
    row = (at.x, at.y, at.z, turn.x, turn.y, turn.z, turn.w)
    parent, child = plain(message.header.frame_id), plain(message.child_frame_id)
    return StampedTransform(received, stamp(message, received), parent, child, row, static)


def on_one_clock(recorded: RecordedMessages, warnings: WarningCounter) -> RecordedMessages:
    """The messages with their stamps or, where these are not of one clock, times of recording."""
    scans = np.array([one.time for one in recorded.sweeps])
    moving = np.array([one.time for one in recorded.frames if not one.static])
    moves = recorded.odometry.times if len(recorded.odometry.times) else moving
    apart = len(moves) and (moves.max() < scans.min() or moves.min() > scans.max())
    back = (np.diff(scans) < -MAX_STEP_BACK).any() or (
        np.diff(recorded.odometry.times) < -MAX_STEP_BACK
    ).any()
    if not (apart or back):
        return recorded
    why = "stamps of scans and odometry are of different clocks" if apart else "stamps run back"
    warnings.add(f"{why}, times of recording used", 1)
    return RecordedMessages(
        [one._replace(time=one.received) for one in recorded.sweeps],
        recorded.odometry._replace(times=recorded.odometry.received),
        [one._replace(time=one.received) for one in recorded.frames],
    )


def tree_of(recorded: RecordedMessages, warnings: WarningCounter) -> Transforms:
    """The tree of frames; an invalid transform is counted in the warnings."""
    tree = Transforms()
    for number, one in enumerate(recorded.frames, 1):
        if not tree.add(one.parent, one.child, (one.time, *one.row)):
            kind = f"transform {one.parent} to {one.child} that is none, left out"
            warnings.add(kind, number)
    return tree
