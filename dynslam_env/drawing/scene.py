"""Scene and Belief: the content of a picture; and interpolation between two, for smooth motion."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from dynslam_env.simulation.world_batch import WorldBatch
from slam.geometry import Array, Pose2
from slam.grid import OccupancyGrid
from slam.scan import Scan


class Scene(NamedTuple):
    """The true state of a world, to be drawn.

    walls    (w, 4) m
    leaves   (d, 4, 4) current edges of the door leaves, m
    sweeps   (d, 4) hinge x, y in m, closed direction and opening angle (with its sign) in rad
    scan     the last scan
    pose     of the robot
    radius   of the robot, m
    trail    past poses of the robot
    title    a line of text
    people   (p, 3) x, y, radius, m
    sensor   pose of the laser at the time of the scan (world_from_sensor); None: its current pose
    """

    walls: Array
    leaves: Array
    sweeps: Array
    scan: Scan
    pose: Pose2
    radius: float
    trail: Sequence[Pose2]
    title: str
    people: Array = np.empty((0, 3))
    sensor: Pose2 | None = None

    @property
    def taken_from(self) -> Pose2:
        """Pose of the laser at the time of the scan, world."""
        return self.pose @ self.scan.mount if self.sensor is None else self.sensor


class Belief(NamedTuple):
    """The belief of a SLAM: map, pose and trail of the robot in it, and a line of text."""

    grid: OccupancyGrid
    pose: Pose2
    trail: Sequence[Pose2]
    title: str


def scene_between(a: Scene, b: Scene, share: float) -> Scene:
    """Interpolate at `share` (0 .. 1) between two scenes of the same episode.

    The scan is the nearer of the two, drawn from the pose at which it was taken.
    """
    near = b if share >= 0.5 else a
    return b._replace(
        leaves=a.leaves + share * (b.leaves - a.leaves),
        people=a.people + share * (b.people - a.people),
        pose=pose_between(a.pose, b.pose, share),
        scan=near.scan,
        sensor=near.taken_from,
    )


def belief_between(a: Belief, b: Belief, share: float) -> Belief:
    """Interpolate the pose at `share` (0 .. 1) between two beliefs; the map is that of `b`."""
    return b._replace(pose=pose_between(a.pose, b.pose, share))


def pose_between(a: Pose2, b: Pose2, share: float) -> Pose2:
    """Interpolate linearly at `share` (0 .. 1) between two poses, with the smaller turn."""
    turn = math.remainder(b.theta - a.theta, math.tau)
    return Pose2(a.x + share * (b.x - a.x), a.y + share * (b.y - a.y), a.theta + share * turn)


def scene(batch: WorldBatch, i: int, trail: Sequence[Pose2]) -> Scene:
    """The current scene of world `i`; `trail` holds the past poses of its robot."""
    layout, world, config = batch.layouts[i], batch.worlds[i], batch.config
    angle = config.doors.open_angle
    sweeps = [(*d.hinge, d.closed, 0.0 if d.slides else d.swing * angle) for d in layout.doors]
    edges = world.segments[world.first_edge :][: 4 * len(layout.doors)]
    scan = batch.scanners[i].scan(batch.ranges[i].copy(), world.time)
    pose = Pose2.of(batch.drive.poses[i])
    title = f"truth   {world.time:5.1f} s"
    leaves, swings = edges.copy().reshape(-1, 4, 4), np.array(sweeps).reshape(-1, 4)
    radii = np.full(len(world.people), config.people.radius)
    people = np.column_stack([world.people, radii])
    return Scene(
        layout.walls, leaves, swings, scan, pose, config.robot.radius, trail, title, people
    )
