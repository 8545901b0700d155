"""How well a robot could know its pose in a world that is known: the Cramer-Rao bound of scans."""

from __future__ import annotations

import math

import numpy as np

from dynslam_env.sensors.laser import Laser, Scanner
from dynslam_env.simulation.fleet import Fleet
from slam.episode import Episode
from slam.errors import InputError
from slam.geometry import Array, Pose2
from slam.metrics.cramer_rao import Bound, bound, information, ray_gradient


def pose_bound(fleet: Fleet, i: int) -> Bound:
    """The bound of the pose of robot `i` from the echoes of its last scan, the place being known.

    Censi (2007). Raises InputError for a laser without noise.
    """
    world, pose = fleet.worlds[i], Pose2.of(fleet.drive.poses[i])
    heard = np.isfinite(fleet.ranges[i])
    return _scan_bound(fleet.scanners[i], pose, world.segments, world.first_edge, heard)


def position_bounds(episode: Episode) -> Array:
    """(n,) m: no unbiased estimate of the position from the one scan alone, in the true map as it
    stood at that scan, has a smaller root of its mean squared error. Infinite where the scan says
    nothing about a direction.

    That is localization in a known place. A SLAM has to make its map from poses that are as
    uncertain, and may do better only by what it remembers of earlier scans and by its odometry.
    The episode is one of `record`: with its truth, and the laser's noise in its `meta`. All scans
    are of one laser. Raises InputError for any other, and for a laser without noise.
    """
    truth = episode.truth
    if truth is None:
        raise InputError("the bound of an episode needs one with the truth, got one without")
    scanner = _scanner(episode)
    bounds = np.empty(len(episode.scans))
    for k, scan in enumerate(episode.scans):
        segments = np.concatenate([truth.walls, truth.doors[k]])
        pose = Pose2.of(truth.poses[k])
        found = _scan_bound(scanner, pose, segments, len(truth.walls), scan.hit)
        bounds[k] = np.hypot(found.std_x, found.std_y)
    return bounds


def _scanner(episode: Episode) -> Scanner:
    """The laser that the scans were made with."""
    scan = episode.scans[0]
    try:
        sigma = episode.meta["config"]["laser"]["sigma"]
    except (KeyError, TypeError):
        raise InputError("the bound of an episode needs meta['config']['laser']['sigma']") from None
    view = float(scan.angles[-1] - scan.angles[0]) or math.tau  # of a single beam it is all one
    laser = Laser(len(scan.angles), view, scan.max_range, scan.min_range, sigma, mount=scan.mount)
    if any(not np.array_equal(other.angles, laser.angles) for other in episode.scans):
        raise InputError("the bound of an episode needs scans of one laser of evenly spread beams")
    return Scanner(laser, np.random.default_rng(0))


def _scan_bound(
    scanner: Scanner, pose: Pose2, segments: Array, first_edge: int, heard: np.ndarray
) -> Bound:
    """The bound of one scan, of which the beams `heard` (beams,) gave an echo."""
    ranges = scanner.exact(pose, segments, first_edge)
    echoes = heard & (scanner.hits >= 0)
    x1, y1, x2, y2 = segments[scanner.hits[echoes]].T
    normals = np.zeros((len(ranges), 2))
    normals[echoes] = np.column_stack([y1 - y2, x2 - x1]) / np.hypot(x2 - x1, y2 - y1)[:, None]
    ranges[~echoes] = np.inf
    laser = scanner.laser
    gradient = ray_gradient(pose, scanner.angles, ranges, normals, laser.mount)
    return bound(information(gradient, laser.sigma))
