"""Episodes as ROS recordings, for ROS tools and other SLAM systems."""

from __future__ import annotations

from slam.episode import Episode
from slam.geometry import Pose2
from slam.io.bags.bag_writer import BagWriter, check_times, new_bag
from slam.io.constant_mount import constant_mount
from slam.io.files import AnyPath

BASE, LASER, ODOM, WORLD = "base_link", "laser", "odom", "world"


def write_bag(episode: Episode, path: AnyPath) -> None:
    """Write .bag (ROS 1), .mcap or .db3 (ROS 2, Humble and later), or without an ending, a new
    folder that `ros2 bag` plays.

    /scan          in the frame `laser`; no echo is inf, no reading NaN (REP 117)
    /odom, /tf     the odometry, where there is one: `base_link` in `odom`
    /tf_static     the laser's mounting: `laser` in `base_link`
    /ground_truth  where the truth is known: `base_link` in `world`

    Stamps are the episode's. Raises InputError for beams that are not evenly spread, a laser that
    moves on the robot, and where the folder exists or the file cannot be written.
    """
    mount = constant_mount(episode)
    check_times(episode)
    with new_bag(path) as out:
        first = episode.scans[0].time
        out.put("/tf_static", first, out.make.transform(first, BASE, LASER, mount))
        for time, topic, number in _events(episode):
            _put(out, episode, time, topic, number)


def _events(episode: Episode) -> list[tuple[float, str, int]]:
    """The messages in order of time: (s, topic, sequence number within the topic)."""
    events = [(scan.time, "/scan", k) for k, scan in enumerate(episode.scans)]
    if episode.has_odometry:
        events += [(time, "/odom", k) for k, time in enumerate(episode.odometry.times.tolist())]
    return sorted(events)


def _put(out: BagWriter, episode: Episode, time: float, topic: str, number: int) -> None:
    if topic == "/odom":
        pose = Pose2.of(episode.odometry.poses[number])
        out.put("/tf", time, out.make.transform(time, ODOM, BASE, pose))
        out.put("/odom", time, out.make.odometry(time, ODOM, BASE, pose))
        return
    out.put("/scan", time, out.make.scan(episode.scans[number], LASER))
    if episode.truth is not None:
        true = Pose2.of(episode.truth.poses[number])
        out.put("/ground_truth", time, out.make.odometry(time, WORLD, BASE, true))
