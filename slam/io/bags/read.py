"""ROS recordings become Episodes: a laser's scans, the odometry beside them, the laser's mounting.

A topic that occurs once is found by its type; where there are several, the error lists them. What
cannot be used is left out and counted in `warnings`.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from slam.bounds import MAX_RANGE
from slam.episode import Episode
from slam.errors import InputError
from slam.geometry import Array, Pose2
from slam.io.bags.bag import Bag, open_bag
from slam.io.bags.laser_scan import LASER, MULTI_ECHO, Sweep, readings
from slam.io.bags.poses import ODOMETRY, Poses, is_truth
from slam.io.bags.recorded_messages import (
    RecordedMessages,
    on_one_clock,
    read_messages,
    tree_of,
)
from slam.io.bags.robot import mounts_of, odometry_of
from slam.io.files import AnyPath
from slam.io.guard import RECORD_BYTES, guarded, take
from slam.io.loaded_recording import LoadedRecording, SourceSelection
from slam.io.max_range import estimated_max_range
from slam.io.one_line import listed, one_line
from slam.io.warnings import WarningCounter
from slam.scan import Scan
from slam.trajectory import Trajectory

MAX_BEYOND_ODOMETRY = 0.3  # s: of a scan before the first or after the last odometry


def read_bag(path: AnyPath, choice: SourceSelection = SourceSelection()) -> LoadedRecording:
    """Read a ROS 1 bag, or a ROS 2 bag (a folder, .mcap or .db3).

    Scans are sensor_msgs/LaserScan. The odometry is that of nav_msgs/Odometry (/odom, or the only
    such topic) or else the frame of /tf above the robot whose name has "odom" in it. The pose
    of the laser on the robot comes from /tf_static or /tf, or from `choice`; a laser mounted upside
    down is recognised. Times are the messages' stamps; where those are of different clocks, or run
    backwards, the times at which the messages were recorded. Raises InputError.
    """
    warnings = WarningCounter("message")
    with guarded(path), open_bag(path, warnings) as bag:
        laser = _laser(bag, choice.laser)
        topic = _odometry_topic(bag, choice.odometry)
        recorded = read_messages(bag, laser, topic, warnings)
        episode = _episode(recorded, laser, topic, choice, warnings)
    episode = replace(episode, meta={"source": Path(path).name, **episode.meta})
    return LoadedRecording(episode, warnings.counted())


def _episode(
    recorded: RecordedMessages,
    laser: str,
    topic: str | None,
    choice: SourceSelection,
    warnings: WarningCounter,
) -> Episode:
    if not recorded.sweeps:
        raise InputError(f"no usable scan on {one_line(laser)}")
    recorded = on_one_clock(recorded, warnings)
    tree = tree_of(recorded, warnings)
    trajectory, base, source = odometry_of(recorded, tree, topic, choice.odometry, warnings)
    sweeps = _in_order(recorded.sweeps, trajectory, warnings)
    if not sweeps:
        raise InputError(f"no scan of {one_line(laser)} lies within the time of the odometry")
    times = np.array([one.time for one in sweeps])
    mounts, flipped = mounts_of(tree, base, sweeps[0].frame, times, choice.mount, warnings)
    scans = _scans(sweeps, mounts, flipped, warnings)
    if trajectory is None:
        trajectory = Trajectory(times, np.zeros((len(times), 3)))
    return Episode(scans, trajectory, meta={"laser": laser, "odometry": source})


def read_reference(path: AnyPath, topic: str) -> Trajectory:
    """The poses of a topic whose messages have a pose, such as a reference system's."""
    warnings = WarningCounter("message")
    poses = Poses()
    with guarded(path), open_bag(path, warnings) as bag:
        if topic not in bag.topics:
            raise InputError(f"{path}: no topic {topic!r}; there are {listed(list(bag.topics))}")
        for _, received, message in bag.messages([topic]):
            if not hasattr(message, "pose"):
                raise InputError(f"{path}: {topic} is a {bag.topics[topic].kind} and tells no pose")
            take(RECORD_BYTES)
            poses.add(received, message)
    stamped = poses.collected()
    if not len(stamped.times):
        raise InputError(f"{path}: no usable pose on {topic}")
    times, first = np.unique(stamped.times, return_index=True)
    return Trajectory(times, stamped.poses[first])


def _laser(bag: Bag, wanted: str | None) -> str:
    lasers = bag.named(LASER)
    if wanted is not None:
        if wanted in lasers:
            return wanted
        raise InputError(f"{bag.path}: no scans on {wanted!r}; lasers: {listed(lasers)}")
    if len(lasers) == 1:
        return lasers[0]
    if lasers:
        raise InputError(f"{bag.path}: several lasers, choose one (--laser): {listed(lasers)}")
    many = bag.named(MULTI_ECHO)
    if many:
        raise InputError(
            f"{bag.path}: {listed(many)} is a MultiEchoLaserScan, several ranges a beam, which is "
            f"not read; laser_proc makes LaserScans of it"
        )
    raise InputError(f"{bag.path}: no {LASER} in it; topics: {listed(list(bag.topics))}")


def _odometry_topic(bag: Bag, wanted: str | None) -> str | None:
    """The topic of nav_msgs/Odometry; None if the odometry is in /tf, or there is none."""
    topics = bag.named(ODOMETRY)
    if wanted is not None:
        return wanted if wanted in topics else None
    topics = [name for name in topics if not is_truth(name)]
    if "/odom" in topics:
        return "/odom"
    if len(topics) > 1:
        several = f"several odometries, choose one (--odometry): {listed(topics)}"
        raise InputError(f"{bag.path}: {several}")
    return topics[0] if topics else None


def _in_order(
    sweeps: list[Sweep], odometry: Trajectory | None, warnings: WarningCounter
) -> list[Sweep]:
    """Sweeps in order of time, each time once, within the time of the odometry."""
    kept: list[Sweep] = []
    for number, one in enumerate(sorted(sweeps, key=lambda one: one.time), 1):
        if kept and one.time <= kept[-1].time:
            warnings.add("two scans of the same time, the second left out", number)
        elif odometry is not None and not (
            odometry.times[0] - MAX_BEYOND_ODOMETRY
            <= one.time
            <= odometry.times[-1] + MAX_BEYOND_ODOMETRY
        ):
            warnings.add("scan before or after all odometry, left out", number)
        else:
            kept.append(one)
    return kept


def _scans(
    sweeps: list[Sweep], mounts: list[Pose2], flipped: np.ndarray, warnings: WarningCounter
) -> tuple[Scan, ...]:
    guessed = 0.0
    mirrored: dict[int, Array] = {}
    scans = []
    for number, (one, mount) in enumerate(zip(sweeps, mounts, strict=True)):
        low, high = one.reach
        low = low if 0 <= low <= MAX_RANGE else 0.0
        if not low < high <= MAX_RANGE:
            guessed = guessed or estimated_max_range([one.ranges for one in sweeps])
            warnings.add(f"range_max {high:g} is no reach, {guessed:g} m assumed", number + 1)
            low, high = min(low, 0.5 * guessed), guessed
        angles = one.angles
        if flipped[number]:
            angles = mirrored.setdefault(id(angles), -angles)
        ranges = readings(one.ranges, low, high)
        scans.append(Scan(ranges, angles, high, low, one.time, mount, one.step))
    return tuple(scans)
