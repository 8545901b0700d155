"""What is taken out of a ROS recording: one laser, one odometry, all frames, on one clock."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from slam.io.bags.file import Bag
from slam.io.bags.laser_scan import Sweep, sweep
from slam.io.bags.poses import Poses, Stamped, stamp
from slam.io.bags.transforms import Transforms, plain
from slam.io.warnings import WarningCounter

FRAMES = ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage")
SET_BACK = 1.0  # s: stamps that run back by more are no clock


class StampedTransform(NamedTuple):
    """One transform of /tf or /tf_static.

    received  s, when it was recorded
    time      s, its stamp
    parent    the frame that it is told in
    child     the frame that it places there
    row       x, y, z in m and quaternion x, y, z, w
    still     whether it is of /tf_static
    """

    received: float
    time: float
    parent: str
    child: str
    row: tuple[float, ...]
    still: bool


class RecordedMessages(NamedTuple):
    """What was taken out of a recording, in the order in which it was recorded."""

    sweeps: list[Sweep]
    odometry: Stamped
    frames: list[StampedTransform]


def take(bag: Bag, laser: str, topic: str | None, warnings: WarningCounter) -> RecordedMessages:
    """Read the messages of one laser, of the odometry's topic if there is one, and all frames."""
    sweeps: list[Sweep] = []
    poses = Poses()
    frames: list[StampedTransform] = []
    names = [laser, *([topic] if topic else []), *bag.named(*FRAMES)]
    for number, (name, received, message) in enumerate(bag.messages(names), 1):
        if name == laser:
            one = sweep(received, message)
            if one is None:
                warnings.add("scan without beams or without angles, left out", number)
            else:
                sweeps.append(one)
        elif name == topic:
            if not poses.add(received, message):
                warnings.add("odometry that is no pose, left out", number)
        else:
            still = "static" in name
            frames += [_frame(received, told, still) for told in message.transforms]
    return RecordedMessages(sweeps, poses.collected(), frames)


def _frame(received: float, told: Any, still: bool) -> StampedTransform:
    at, turn = told.transform.translation, told.transform.rotation
    row = (at.x, at.y, at.z, turn.x, turn.y, turn.z, turn.w)
    parent, child = plain(told.header.frame_id), plain(told.child_frame_id)
    return StampedTransform(received, stamp(told, received), parent, child, row, still)


def on_one_clock(recorded: RecordedMessages, warnings: WarningCounter) -> RecordedMessages:
    """The stamps, or where they are no common clock, the times of recording."""
    scans = np.array([one.time for one in recorded.sweeps])
    moving = np.array([one.time for one in recorded.frames if not one.still])
    told = recorded.odometry.times if len(recorded.odometry.times) else moving
    apart = len(told) and (told.max() < scans.min() or told.min() > scans.max())
    back = (np.diff(scans) < -SET_BACK).any() or (
        np.diff(recorded.odometry.times) < -SET_BACK
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
    """The frames; what cannot be a transform is counted in the warnings."""
    tree = Transforms()
    for number, one in enumerate(recorded.frames, 1):
        if not tree.add(one.parent, one.child, (one.time, *one.row)):
            kind = f"transform {one.parent} to {one.child} that is none, left out"
            warnings.add(kind, number)
    return tree
