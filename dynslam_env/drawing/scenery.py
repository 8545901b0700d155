"""What is to be drawn of a world of a fleet."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from dynslam_env.drawing.scene import Scene
from dynslam_env.fleet import Fleet
from slam.geometry import Pose2


def scene(fleet: Fleet, i: int, trail: Sequence[Pose2]) -> Scene:
    """The truth of world `i` as it stands; `trail` is where its robot has been."""
    layout, world, setup = fleet.layouts[i], fleet.worlds[i], fleet.setup
    angle = setup.doors.open_angle
    sweeps = [(*d.hinge, d.closed, d.swing * angle) for d in layout.doors]
    edges = world.segments[world.first_edge :][: 4 * len(layout.doors)]
    scan = fleet.scanners[i].scan(fleet.ranges[i].copy(), world.time)
    pose = Pose2.of(fleet.drive.poses[i])
    title = f"truth   {world.time:5.1f} s"
    leaves, swings = edges.copy().reshape(-1, 4, 4), np.array(sweeps).reshape(-1, 4)
    radii = np.full(len(world.people), setup.people.radius)
    people = np.column_stack([world.people, radii])
    return Scene(layout.walls, leaves, swings, scan, pose, setup.robot.radius, trail, title, people)
