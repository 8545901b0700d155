"""How well a robot could know its pose in a world of a fleet: the Cramer-Rao bound of its scan."""

from __future__ import annotations

import numpy as np

from dynslam_env.fleet import Fleet
from slam.geometry import Pose2
from slam.metrics.bound import Bound, bound, information, ray_gradient


def pose_bound(fleet: Fleet, i: int) -> Bound:
    """The bound of the pose of robot `i` from the echoes of its last scan, the place being known.

    Censi (2007). Raises InputError for a laser without noise.
    """
    scanner, world, pose = fleet.scanners[i], fleet.worlds[i], Pose2.of(fleet.drive.poses[i])
    ranges = scanner.exact(pose, world.segments, world.first_edge)
    echoes = np.isfinite(fleet.ranges[i]) & (scanner.hits >= 0)
    x1, y1, x2, y2 = world.segments[scanner.hits[echoes]].T
    normals = np.zeros((len(ranges), 2))
    normals[echoes] = np.column_stack([y1 - y2, x2 - x1]) / np.hypot(x2 - x1, y2 - y1)[:, None]
    ranges[~echoes] = np.inf
    laser = fleet.setup.laser
    gradient = ray_gradient(pose, scanner.angles, ranges, normals, laser.mount)
    return bound(information(gradient, laser.sigma))
