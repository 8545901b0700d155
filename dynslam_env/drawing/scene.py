"""Scene and Belief: what there is to draw; and a scene between two others, for smooth motion."""

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
    """The truth to be drawn.

    walls    (w, 4) m
    leaves   (d, 4, 4) edges of the door leaves as they stand, m
    sweeps   (d, 4) hinge x, y in m, closed direction and opening angle (with its sign) in rad
    scan     the last one
    pose     of the robot
    radius   of the robot, m
    trail    poses so far
    title    a line of text
    people   (p, 3) x, y, radius, m
    sensor   the laser when it took the scan (world_from_sensor); None: where the robot has it now
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
        """The laser when it took the scan, world."""
        return self.pose @ self.scan.mount if self.sensor is None else self.sensor


class Belief(NamedTuple):
    """What a SLAM believes: its map, the robot's pose and its trail in it, a line of text."""

    grid: OccupancyGrid
    pose: Pose2
    trail: Sequence[Pose2]
    title: str


def scene_between(a: Scene, b: Scene, share: float) -> Scene:
    """The scene at `share` (0 .. 1) of the way from `a` to `b`, two of the same episode.

    The scan is one that was really taken, drawn from where it was.
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
    """The belief at `share` (0 .. 1) of the way from `a` to `b`; the map is that of `b`."""
    return b._replace(pose=pose_between(a.pose, b.pose, share))


def pose_between(a: Pose2, b: Pose2, share: float) -> Pose2:
    """The pose at `share` (0 .. 1) of the straight way from `a` to `b`, turning the short way."""
    turn = math.remainder(b.theta - a.theta, math.tau)
    return Pose2(a.x + share * (b.x - a.x), a.y + share * (b.y - a.y), a.theta + share * turn)


def scene(batch: WorldBatch, i: int, trail: Sequence[Pose2]) -> Scene:
    """The truth of world `i` as it stands; `trail` is where its robot has been."""
    layout, world, config = batch.layouts[i], batch.worlds[i], batch.config
    angle = config.doors.open_angle
    sweeps = [(*d.hinge, d.closed, d.swing * angle) for d in layout.doors]
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
