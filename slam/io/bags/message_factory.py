"""ROS messages of scans, poses and maps, by the definitions of ROS 1 or ROS 2."""

from __future__ import annotations

from typing import Any

import numpy as np
from rosbags.typesys.store import Typestore

from slam.errors import InputError
from slam.geometry import Array, Pose2
from slam.grid import OccupancyGrid
from slam.scan import Scan

EVEN_TOLERANCE = 1e-6  # rad: beams this close to an even spread are even


class MessageFactory:
    """Makes messages with the types of `store`."""

    def __init__(self, store: Typestore):
        self._types = store.types
        fields = store.get_msgdef("std_msgs/msg/Header").fields
        self._sequenced = any(name == "seq" for name, _ in fields)  # in ROS 1
        self._number = 0

    def scan(self, scan: Scan, frame: str) -> Any:
        """sensor_msgs/LaserScan: no echo is inf, no reading NaN (REP 117). Raises InputError for
        beams that are not evenly spread."""
        angles, step = scan.angles, _step(scan.angles)
        if not len(angles):
            raise InputError("a bag needs scans with beams")
        if not even(angles):
            raise InputError("a bag needs evenly spread beams")
        low, high = np.float32(scan.min_range), np.float32(scan.max_range)
        ranges = scan.ranges.astype(np.float32)
        ranges[scan.hit] = np.minimum(
            ranges[scan.hit], np.nextafter(high, low)
        )  # rounding must not make it "no echo"
        ranges[~scan.hit] = np.where(scan.no_echo[~scan.hit], np.inf, np.nan)
        return self._make(
            "sensor_msgs/msg/LaserScan", header=self.header(scan.time, frame),
            angle_min=float(angles[0]), angle_max=float(angles[-1]), angle_increment=float(step),
            time_increment=scan.beam_time, scan_time=scan.beam_time * len(angles),
            range_min=float(low), range_max=float(high), ranges=ranges,
            intensities=np.zeros(0, np.float32),
        )  # fmt: skip

    def cloud(self, scan: Scan, frame: str) -> Any:
        """sensor_msgs/PointCloud2 of the echoes, in the laser's frame."""
        ranges, angles = scan.ranges[scan.hit], scan.angles[scan.hit]
        points = np.zeros((len(ranges), 3), np.float32)
        points[:, 0], points[:, 1] = ranges * np.cos(angles), ranges * np.sin(angles)
        fields = [
            self._make("sensor_msgs/msg/PointField", name=name, offset=4 * k, datatype=7, count=1)
            for k, name in enumerate("xyz")
        ]  # 7: float32
        data = points.view(np.uint8).ravel()
        return self._make(
            "sensor_msgs/msg/PointCloud2", header=self.header(scan.time, frame), height=1,
            width=len(points), fields=fields, is_bigendian=False, point_step=12,
            row_step=len(data), data=data, is_dense=True,
        )  # fmt: skip

    def odometry(self, time: float, frame: str, child: str, pose: Pose2) -> Any:
        """nav_msgs/Odometry, without velocities and covariances."""
        zero = self._make("geometry_msgs/msg/Vector3", x=0.0, y=0.0, z=0.0)
        still = self._make("geometry_msgs/msg/Twist", linear=zero, angular=zero)
        unknown = np.zeros(36)
        return self._make(
            "nav_msgs/msg/Odometry", header=self.header(time, frame), child_frame_id=child,
            pose=self._make(
                "geometry_msgs/msg/PoseWithCovariance", pose=self.pose(pose), covariance=unknown
            ),
            twist=self._make(
                "geometry_msgs/msg/TwistWithCovariance", twist=still, covariance=unknown
            ),
        )  # fmt: skip

    def transform(self, time: float, parent: str, child: str, pose: Pose2) -> Any:
        """tf2_msgs/TFMessage with one transform."""
        shift = self._make("geometry_msgs/msg/Vector3", x=pose.x, y=pose.y, z=0.0)
        transform = self._make(
            "geometry_msgs/msg/Transform", translation=shift, rotation=self._turned(pose)
        )
        stamped = self._make(
            "geometry_msgs/msg/TransformStamped", header=self.header(time, parent),
            child_frame_id=child, transform=transform,
        )  # fmt: skip
        return self._make("tf2_msgs/msg/TFMessage", transforms=[stamped])

    def path(self, times: Array, poses: Array, frame: str) -> Any:
        """nav_msgs/Path, stamped with the last of its times."""
        stamped = [
            self._make(
                "geometry_msgs/msg/PoseStamped", header=self.header(time, frame),
                pose=self.pose(Pose2(*row)),
            )
            for time, row in zip(times.tolist(), poses.tolist(), strict=True)
        ]  # fmt: skip
        header = self.header(float(times[-1]), frame)
        return self._make("nav_msgs/msg/Path", header=header, poses=stamped)

    def grid(self, time: float, grid: OccupancyGrid, frame: str) -> Any:
        """nav_msgs/OccupancyGrid: h in percent, -1 for unobserved cells."""
        spec = grid.spec
        data = np.where(grid.observed, np.rint(100 * grid.occupied), -1).astype(np.int8)
        x, y = spec.origin
        info = self._make(
            "nav_msgs/msg/MapMetaData", map_load_time=self._time(time), resolution=spec.resolution,
            width=spec.cols, height=spec.rows, origin=self.pose(Pose2(x, y, 0.0)),
        )  # fmt: skip
        header = self.header(time, frame)
        return self._make("nav_msgs/msg/OccupancyGrid", header=header, info=info, data=data.ravel())

    def pose(self, pose: Pose2) -> Any:
        """geometry_msgs/Pose."""
        point = self._make("geometry_msgs/msg/Point", x=pose.x, y=pose.y, z=0.0)
        return self._make("geometry_msgs/msg/Pose", position=point, orientation=self._turned(pose))

    def header(self, time: float, frame: str) -> Any:
        """std_msgs/Header."""
        fields = {"stamp": self._time(time), "frame_id": frame}
        if self._sequenced:
            self._number += 1
            fields["seq"] = self._number % 2**32
        return self._make("std_msgs/msg/Header", **fields)

    def _time(self, time: float) -> Any:
        seconds, nanoseconds = divmod(round(time * 1e9), 10**9)
        return self._make("builtin_interfaces/msg/Time", sec=seconds, nanosec=nanoseconds)

    def _turned(self, pose: Pose2) -> Any:
        z, w = float(np.sin(pose.theta / 2)), float(np.cos(pose.theta / 2))
        return self._make("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=z, w=w)

    def _make(self, kind: str, **fields: Any) -> Any:
        return self._types[kind](**fields)


def even(angles: Array) -> bool:
    """Whether beams are evenly spread, as a LaserScan's are."""
    straight = angles[:1] + _step(angles) * np.arange(len(angles))
    return bool(np.abs(angles - straight).max(initial=0.0) <= EVEN_TOLERANCE)


def _step(angles: Array) -> float:
    return (angles[-1] - angles[0]) / (len(angles) - 1) if len(angles) > 1 else 0.0
