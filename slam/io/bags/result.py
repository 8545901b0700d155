"""The result of a run as a ROS recording, which Foxglove and rviz show in the frame `map`."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numpy as np

from slam.episode import Episode
from slam.errors import InputError
from slam.geometry import Array, Pose2
from slam.io.bags.bag_writer import BagWriter, check_times, new_bag
from slam.io.bags.message_factory import even
from slam.io.bags.write import BASE, LASER, ODOM
from slam.io.files import AnyPath
from slam.maps.snapshot import MapSnapshot
from slam.scan import Scan

MAP = "map"
MAX_LASERS = 8  # of a robot; a laser with more mounts moves on it
MAX_PATH_POSES = 300  # of a path but the last: all poses each time would grow with n^2

Event = tuple[float, Callable[[BagWriter], None]]
"""A time (s), and the function that writes its message."""


def write_result(
    path: AnyPath, episode: Episode, online: Array, stages: Sequence[MapSnapshot]
) -> None:
    """Write .mcap, .db3 or a folder (ROS 2), or .bag (ROS 1): the topics of a live SLAM.

    online  (n, 3) the pose at each scan as estimated online; n may be less than all scans
    stages  maps and trajectories estimated during the run; the last one is the result

    /map            nav_msgs/OccupancyGrid, latched: one a stage
    /path           nav_msgs/Path: one a stage, thinned to MAX_PATH_POSES; the last one is whole
    /tf             `odom` in `map` at each scan, `base_link` in `odom`; without any odometry,
                    `base_link` in `map`
    /tf_static      `laser` in `base_link`; in /tf where the laser moves on the robot; of several
                    lasers also `laser_2` and so on, whose topics are /scan_2 and /points_2
    /odom           the odometry, where there is one
    /scan, /points  LaserScans, and the echoes of those with uneven beams as PointCloud2

    /tf belongs to the map of its time: a closed loop shows as a jump of `odom` in `map`, together
    with another map and path. Raises InputError if it cannot be written, and
    for times that ROS cannot represent.
    """
    if not len(online):
        raise InputError(f"{path}: nothing to write, no scan was taken in")
    check_times(episode)
    parts = (
        _mounts(episode, len(online)),
        _motion(episode, online),
        _scans(episode, len(online)),
        _beliefs(episode, stages),
    )
    events = sorted((event for part in parts for event in part), key=lambda event: event[0])
    with new_bag(path) as out:
        for _, put in events:
            put(out)


def _frames(scans: Sequence[Scan]) -> dict[Pose2, str]:
    """The frame of each laser by its mount: `laser`, `laser_2` and so on; empty where one laser
    moves on the robot."""
    mounts = dict.fromkeys(scan.mount for scan in scans)
    if len(mounts) > MAX_LASERS:
        return {}
    return {mount: LASER + _ending(number) for number, mount in enumerate(mounts, 1)}


def _ending(number: int) -> str:
    """Of the names of a laser's frame and topics."""
    return f"_{number}" if number > 1 else ""


def _mounts(episode: Episode, count: int) -> Iterator[Event]:
    scans = episode.scans[:count]
    frames = _frames(scans)
    begin = min(scans[0].time, float(episode.odometry.times[0]))
    for mount, frame in frames.items():
        yield begin, _transform("/tf_static", begin, BASE, frame, mount)
    for scan in () if frames else scans:
        yield scan.time, _transform("/tf", scan.time, BASE, LASER, scan.mount)


def _motion(episode: Episode, online: Array) -> Iterator[Event]:
    times = episode.times[: len(online)]
    if not episode.has_odometry:
        for time, pose in zip(times.tolist(), online, strict=True):
            yield time, _transform("/tf", time, MAP, BASE, Pose2.of(pose))
        return
    upto = np.searchsorted(episode.odometry.times, times[-1]) + 1
    recorded = episode.odometry.times[:upto]
    moments = np.union1d(recorded, times)  # the same transform twice makes tf2 warn
    for time, row in zip(moments.tolist(), episode.odometry.at(moments), strict=True):
        pose = Pose2.of(row)
        yield time, _transform("/tf", time, ODOM, BASE, pose)
    for time, row in zip(recorded.tolist(), episode.odometry.poses[: len(recorded)], strict=True):
        yield time, _odometry(time, Pose2.of(row))
    at_scans = episode.odometry.at(times)
    for time, pose, row in zip(times.tolist(), online, at_scans, strict=True):
        frame = Pose2.of(pose) @ Pose2.of(row).inverse()
        yield time, _transform("/tf", time, MAP, ODOM, frame)


def _scans(episode: Episode, count: int) -> Iterator[Event]:
    frames = _frames(episode.scans[:count])
    for scan in episode.scans[:count]:
        frame = frames.get(scan.mount, LASER)
        yield scan.time, partial(_put_scan, scan=scan, frame=frame)


def _put_scan(out: BagWriter, scan: Scan, frame: str) -> None:
    ending = frame.removeprefix(LASER)
    if even(scan.angles):
        out.put(f"/scan{ending}", scan.time, out.make.scan(scan, frame))
    else:
        out.put(f"/points{ending}", scan.time, out.make.cloud(scan, frame))


def _beliefs(episode: Episode, stages: Sequence[MapSnapshot]) -> Iterator[Event]:
    for stage in stages:
        count = len(stage.poses) if stage is stages[-1] else MAX_PATH_POSES
        yield episode.scans[stage.scan].time, partial(_put_belief, episode, stage, count)


def _put_belief(episode: Episode, stage: MapSnapshot, count: int, out: BagWriter) -> None:
    time = episode.scans[stage.scan].time
    chosen = np.unique(np.linspace(0, stage.scan, count).round().astype(int))
    out.put("/map", time, out.make.grid(time, stage.grid, MAP))
    out.put("/path", time, out.make.path(episode.times[chosen], stage.poses[chosen], MAP))


def _transform(
    topic: str, time: float, parent: str, child: str, pose: Pose2
) -> Callable[[BagWriter], None]:
    return lambda out: out.put(topic, time, out.make.transform(time, parent, child, pose))


def _odometry(time: float, pose: Pose2) -> Callable[[BagWriter], None]:
    return lambda out: out.put("/odom", time, out.make.odometry(time, ODOM, BASE, pose))
