"""`python -m docs.making.relation_errors LOG RELATIONS [VARIANT]`: how large the errors of the
relations themselves are.

Registers the two scans of each clear relation with each other, point to line (Chen and Medioni
1992): a third estimate beside the SLAM and the relation. Three estimates with independent errors
tell the mean square of each (Gray and Allan 1974). The SLAM sees the same two scans, so that what
these share counts as the relation's. Some seconds.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from scipy.spatial import KDTree

from slam.benchmark.run import build, run
from slam.geometry import Array, Pose2, between, compose, transform_points
from slam.io.formats import read_log
from slam.io.relations import read_relations
from slam.metrics.relations import carried, clear_at, within
from slam.preprocessing.deskewing import deskewed
from slam.trajectory import Trajectory

LINE, ONE_SURFACE = 5, 0.3  # echoes of a line, and m between them, at most
STRAIGHT = 0.1  # ratio of the spreads across and along it, at most
NEAR = 0.3, 0.1  # m to the line's middle, at most, at first and in the end
ROUNDS, FIRST = 40, 10
SCALE = 0.02  # m, of the Cauchy weights
MIN_ECHOES, MIN_INFORMATION = 30, 15.0  # of a registration, and echoes along its weaker direction
ALIKE = 0.1  # m from the SLAM's displacement: else it found something else


def lines(points: Array) -> tuple[Array, Array]:
    """(m, 2) echoes with straight surroundings, and (m, 2) their normals."""
    runs = np.lib.stride_tricks.sliding_window_view(points, LINE, axis=0)  # (n, 2, LINE)
    centred = runs - runs.mean(2, keepdims=True)
    spread, axes = np.linalg.eigh(centred @ centred.transpose(0, 2, 1))
    gaps = np.hypot(*np.diff(runs, axis=2).transpose(1, 0, 2)).max(1)
    straight = (spread[:, 0] < STRAIGHT * spread[:, 1]) & (gaps < ONE_SURFACE)
    return runs[straight, :, LINE // 2], axes[straight, :, 0]


def registered(points: Array, other: Array, start: Array) -> Array | None:
    """(3,) the pose of one scan's `points` in the frame of the `other`; None if it tells little."""
    if min(len(points), len(other)) < MIN_ECHOES:
        return None
    middles, normals = lines(other)
    if len(middles) < MIN_ECHOES:
        return None
    tree, pose, information = KDTree(middles), np.array(start), np.zeros((3, 3))
    for k in range(ROUNDS):
        moved = transform_points(Pose2.of(pose), points)
        distance, found = (np.asarray(one) for one in tree.query(moved))
        used = distance < NEAR[k >= FIRST]
        if used.sum() < MIN_ECHOES:
            return None
        nearest = found[used]
        normal, arm = normals[nearest], moved[used] - pose[:2]
        off = ((moved[used] - middles[nearest]) * normal).sum(1)
        turned = np.column_stack((-arm[:, 1], arm[:, 0]))
        slope = np.column_stack((normal, (turned * normal).sum(1)))
        weighted = slope / (1.0 + (off / SCALE) ** 2)[:, None]
        information = weighted.T @ slope
        pose -= np.linalg.solve(information + 1e-3 * np.eye(3), weighted.T @ off)
    return pose if np.linalg.eigvalsh(information[:2, :2])[0] > MIN_INFORMATION else None


def main(log: Path, relations: Path, variant: str) -> None:
    """Print the table."""
    episode, known = deskewed(read_log(log).episode), read_relations(relations)
    odometry, times = episode.odometry, episode.times
    found = Trajectory(times, run(build(variant, episode), episode).poses)
    used = np.ones(len(known), np.bool_)
    for stamps in (known.first, known.second):
        used &= within(odometry, stamps) & clear_at(odometry, stamps)
    first, second, true = known.first[used], known.second[used], known.displacement[used]
    ours = between(carried(found, odometry, first), carried(found, odometry, second))
    scans = [np.abs(times - stamps[:, None]).argmin(1) for stamps in (first, second)]
    direct = np.full_like(ours, np.nan)
    for k, (i, j) in enumerate(zip(*scans, strict=True)):
        start = between(found.poses[i], found.poses[j])
        one = registered(episode.scans[j].points, episode.scans[i].points, start)
        if one is not None:  # from the scans to the stamps by the odometry
            here, there = odometry.at(times[[i, j]])
            begin, end = odometry.at(np.array([first[k], second[k]]))
            direct[k] = compose(compose(between(begin, here), one), between(there, end))
    alike = np.hypot(*between(ours, direct)[:, :2].T) < ALIKE
    if not alike.any():
        sys.exit("the scans of no clear relation can be registered with each other")
    pairs = ((ours, true), (direct, true), (ours, direct))
    off = [np.hypot(*between(a[alike], b[alike])[:, :2].T) for a, b in pairs]
    a, b, c = (float((one**2).mean()) for one in off)
    names = f"{variant} to relation", "direct to relation", f"{variant} to direct"
    print(f"{alike.sum()} of {len(true)} clear relations; m, mean and root mean square")
    for name, one in zip(names, off, strict=True):
        print(f"  {name}: {one.mean():.4f}, {np.sqrt((one**2).mean()):.4f}")
    parts = {"relation": a + b - c, variant: a + c - b, "direct": b + c - a}
    for name, twice in parts.items():
        print(f"  of {name} alone, root mean square: {np.sqrt(max(twice / 2.0, 0.0)):.4f}")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3] if len(sys.argv) > 3 else "static-ml")
