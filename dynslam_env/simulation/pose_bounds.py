"""Cramer-Rao bounds of the pose from a scan in a known world."""

from __future__ import annotations

import math

import numpy as np

from dynslam_env.sensors.laser import Laser, Scanner
from dynslam_env.simulation.world_batch import WorldBatch
from slam.episode import Episode
from slam.errors import InputError
from slam.geometry import Array, Pose2
from slam.metrics.cramer_rao import Bound, bound, information, ray_gradient


def pose_bound(batch: WorldBatch, i: int) -> Bound:
    """The bound of the pose of robot `i` from its last scan, given the true map.

    Censi (2007). Raises InputError for a laser without noise, and for one with effects.
    """
    _no_effects(batch.config.laser.effects)
    world, pose = batch.worlds[i], Pose2.of(batch.drive.poses[i])
    heard = np.isfinite(batch.ranges[i])
    return _scan_bound(batch.scanners[i], pose, world.segments, world.first_edge, heard)


def position_bounds(episode: Episode) -> Array:
    """(n,) m, lower bounds of the RMS error of the position, one per scan.

    No unbiased estimator that uses this scan only and the true map at its time has a smaller RMS
    error. Infinite where the scan leaves a direction unobservable.

    This is the bound for localization in a known map. A SLAM builds its map from poses that are as
    uncertain; only earlier scans and odometry let it do better. The episode must come from
    `record`: with its truth, the laser's noise in its `meta`, and all scans from one laser. Raises
    InputError for any other, for a laser without noise, and for one with effects.
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
    """The laser of the scans."""
    scan = episode.scans[0]
    try:
        sigma = episode.meta["config"]["laser"]["sigma"]
    except (KeyError, TypeError):
        raise InputError("the bound of an episode needs meta['config']['laser']['sigma']") from None
    _no_effects(episode.meta["config"]["laser"].get("effects"))
    view = float(scan.angles[-1] - scan.angles[0]) or math.tau  # any value serves for a single beam
    laser = Laser(len(scan.angles), view, scan.max_range, scan.min_range, sigma, mount=scan.mount)
    if any(not np.array_equal(other.angles, laser.angles) for other in episode.scans):
        raise InputError("the bound of an episode needs scans of one laser of evenly spread beams")
    return Scanner(laser, np.random.default_rng(0))


def _no_effects(effects: object) -> None:
    if effects:
        raise InputError("the bound of the pose is not known for a laser with effects")


def _scan_bound(
    scanner: Scanner, pose: Pose2, segments: Array, first_edge: int, heard: np.ndarray
) -> Bound:
    """The bound from one scan; `heard` (beams,) marks the beams with an echo."""
    ranges = scanner.exact(pose, segments, first_edge)
    echoes = heard & (scanner.hits >= 0)
    x1, y1, x2, y2 = segments[scanner.hits[echoes]].T
    normals = np.zeros((len(ranges), 2))
    normals[echoes] = np.column_stack([y1 - y2, x2 - x1]) / np.hypot(x2 - x1, y2 - y1)[:, None]
    ranges[~echoes] = np.inf
    laser = scanner.laser
    gradient = ray_gradient(pose, scanner.angles, ranges, normals, laser.mount)
    return bound(information(gradient, laser.sigma))
