"""Episodes as ROS 2 bags: a folder with metadata.yaml and the messages in an MCAP file."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.interfaces import (
    Connection,
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import StoragePlugin, Writer, WriterError
from rosbags.typesys import Stores, get_typestore

from slam.episode import Episode
from slam.errors import InputError
from slam.geometry import Pose2
from slam.io.files import AnyPath
from slam.scan import Scan

EVEN = 1e-6  # rad: beams that are less uneven count as even
STORE = get_typestore(Stores.ROS2_HUMBLE)
TOPICS = {
    "/scan": "sensor_msgs/msg/LaserScan",
    "/odom": "nav_msgs/msg/Odometry",
    "/ground_truth": "nav_msgs/msg/Odometry",
    "/tf": "tf2_msgs/msg/TFMessage",
    "/tf_static": "tf2_msgs/msg/TFMessage",
}


FOREVER = QosTime(9_223_372_036, 854_775_807)
LATCHED = Qos(
    QosHistory.KEEP_LAST, 1, QosReliability.RELIABLE, QosDurability.TRANSIENT_LOCAL, FOREVER,
    FOREVER, QosLiveliness.AUTOMATIC, FOREVER, avoid_ros_namespace_conventions=False,
)  # fmt: skip
"""As tf2 asks of /tf_static: it does not listen to a publisher that offers less."""


def write_rosbag(episode: Episode, folder: AnyPath) -> None:
    """Write a bag that ROS 2 tools (Humble and later) play and SLAM systems listen to.

    /scan          in the frame `laser`; no echo is inf, no reading NaN (REP 117)
    /odom, /tf     the odometry: `base_link` in `odom`
    /tf_static     the laser's mounting: `laser` in `base_link`
    /ground_truth  where the truth is known: `base_link` in `world`

    Stamps are the episode's. Raises InputError for beams that are not evenly spread, a laser that
    moves on the robot, and where the folder exists or cannot be written.
    """
    folder = Path(folder)
    mount = episode.scans[0].mount
    if any(scan.mount != mount for scan in episode.scans):
        raise InputError("a bag needs a laser that stays where it is on the robot")
    if folder.exists():
        raise InputError(f"{folder}: is there already; a bag is written into a new folder")
    try:
        with tempfile.TemporaryDirectory(dir=folder.parent) as temporary:
            made = Path(temporary) / folder.name  # the file in it is named after it
            with Writer(made, version=8, storage_plugin=StoragePlugin.MCAP) as writer:
                _write(episode, writer)
            made.rename(folder)
    except (OSError, WriterError) as error:
        raise InputError(f"{folder}: cannot be written ({error})") from None


def _write(episode: Episode, writer: Writer) -> None:
    connections = {
        topic: writer.add_connection(
            topic,
            kind,
            typestore=STORE,
            offered_qos_profiles=[LATCHED] if topic == "/tf_static" else [],
        )
        for topic, kind in TOPICS.items()
        if topic != "/ground_truth" or episode.truth is not None
    }

    def put(topic: str, time: float, message: Any) -> None:
        connection: Connection = connections[topic]
        data = STORE.serialize_cdr(message, connection.msgtype)
        writer.write(connection, round(time * 1e9), data)

    first = episode.scans[0]
    put("/tf_static", first.time, _transforms(first.time, "base_link", "laser", first.mount))
    steps = list(zip(episode.odometry.times.tolist(), episode.odometry.poses, strict=True))
    k = 0
    for number, scan in enumerate(episode.scans):
        while k < len(steps) and steps[k][0] <= scan.time:
            time, pose = steps[k][0], Pose2.of(steps[k][1])
            put("/tf", time, _transforms(time, "odom", "base_link", pose))
            put("/odom", time, _odometry(time, "odom", pose))
            k += 1
        put("/scan", scan.time, _scan(scan))
        if episode.truth is not None:
            true = Pose2.of(episode.truth.poses[number])
            put("/ground_truth", scan.time, _odometry(scan.time, "world", true))


def _scan(scan: Scan) -> Any:
    angles = scan.angles
    step = (angles[-1] - angles[0]) / (len(angles) - 1) if len(angles) > 1 else 0.0
    if np.abs(angles - (angles[0] + step * np.arange(len(angles)))).max(initial=0.0) > EVEN:
        raise InputError("a bag needs evenly spread beams")
    ranges = np.where(scan.no_echo, np.inf, scan.ranges).astype(np.float32)
    return _make(
        "sensor_msgs/msg/LaserScan", header=_header(scan.time, "laser"),
        angle_min=float(angles[0]), angle_max=float(angles[-1]), angle_increment=float(step),
        time_increment=0.0, scan_time=0.0, range_min=scan.min_range, range_max=scan.max_range,
        ranges=ranges, intensities=np.zeros(0, np.float32),
    )  # fmt: skip


def _odometry(time: float, frame: str, pose: Pose2) -> Any:
    zero = _make("geometry_msgs/msg/Vector3", x=0.0, y=0.0, z=0.0)
    point = _make("geometry_msgs/msg/Point", x=pose.x, y=pose.y, z=0.0)
    here = _make("geometry_msgs/msg/Pose", position=point, orientation=_turned(pose))
    nothing = np.zeros(36)
    return _make(
        "nav_msgs/msg/Odometry", header=_header(time, frame), child_frame_id="base_link",
        pose=_make("geometry_msgs/msg/PoseWithCovariance", pose=here, covariance=nothing),
        twist=_make(
            "geometry_msgs/msg/TwistWithCovariance",
            twist=_make("geometry_msgs/msg/Twist", linear=zero, angular=zero), covariance=nothing,
        ),
    )  # fmt: skip


def _transforms(time: float, parent: str, child: str, pose: Pose2) -> Any:
    shift = _make("geometry_msgs/msg/Vector3", x=pose.x, y=pose.y, z=0.0)
    transform = _make("geometry_msgs/msg/Transform", translation=shift, rotation=_turned(pose))
    stamped = _make(
        "geometry_msgs/msg/TransformStamped", header=_header(time, parent), child_frame_id=child,
        transform=transform,
    )  # fmt: skip
    return _make("tf2_msgs/msg/TFMessage", transforms=[stamped])


def _turned(pose: Pose2) -> Any:
    z, w = np.sin(pose.theta / 2), np.cos(pose.theta / 2)
    return _make("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=float(z), w=float(w))


def _header(time: float, frame: str) -> Any:
    nanoseconds = round(time * 1e9)
    stamp = _make("builtin_interfaces/msg/Time", sec=nanoseconds // 10**9,
                  nanosec=nanoseconds % 10**9)  # fmt: skip
    return _make("std_msgs/msg/Header", stamp=stamp, frame_id=frame)


def _make(kind: str, **fields: Any) -> Any:
    return STORE.types[kind](**fields)
