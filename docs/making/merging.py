"""How often parts of one drive are merged rightly, and maps of two buildings refused.

    python -m docs.making.merging FIRST LAST

takes the seeds from FIRST to LAST; docs/saved-maps.md has the table of 71 to 76. Doors that a map
calls sure are counted as right within NEAR of a true one, for merged maps and for whole drives.
"""

from __future__ import annotations

import sys
from collections import Counter
from itertools import permutations

import numpy as np
from dynslam_cli.studies.true_doors import middles  # pyright: ignore[reportMissingImports]

from agents import record_path
from slam.benchmark.run import run
from slam.episode import Episode
from slam.errors import InputError
from slam.geometry import Array, Pose2, compose, transform_points
from slam.layers import layers
from slam.registry import make
from slam.sessions.merging import merged
from slam.sessions.session import Session, session_of

STEPS = {"DoorOffice-v0": 1800, "DoorWings-v0": 1500, "DoorLoop-v0": 1200, "DoorCorridor-v0": 600}
PARTS = ((0, 0.6), (0.4, 1)), ((0.45, 1), (0, 0.55)), ((0, 0.45), (0.55, 1))
WRONG = 0.3  # m, median error of the other map's scans
NEAR = 0.4  # m between the middles of a door of the map and of a true one


def part(drive: Episode, share: tuple[float, float]) -> tuple[Session, Array]:
    """The session of a part of a drive, and its true poses."""
    begin, end = (round(one * len(drive.scans)) for one in share)
    only = Episode(drive.scans[begin:end], drive.odometry)
    truth = drive.known_truth("a score").poses[begin:end]
    return session_of(only, run(make("dynamic-graph"), only).poses), truth


def outcome(
    drive: Episode, shares: tuple[tuple[float, float], tuple[float, float]], doors: Array
) -> str:
    """Whether two parts of a drive are merged rightly; told with the median error in m, and with
    the doors of the merged map, given the true ones (d, 2)."""
    (first, start), (other, truth) = (part(drive, share) for share in shares)
    try:
        both = merged(first, other).session
    except InputError:
        return "refused"
    true = {id(s): row for s, row in zip(other.scans, truth, strict=True)}
    kept = [k for k, scan in enumerate(both.scans) if id(scan) in true]
    frame = Pose2.of(start[0]).inverse()
    expected = compose(frame, np.array([true[id(both.scans[k])] for k in kept]))
    error = float(np.median(np.hypot(*(both.poses[kept] - expected)[:, :2].T)))
    print(f"    off by {error:.3f} m, {_sure(both, start[0], doors)}", flush=True)
    return "wrong" if error > WRONG else "merged"


def _sure(session: Session, start: Array, doors: Array) -> str:
    """Of how many doors its map is sure, and how many are right; its frame lies at `start`."""
    found = [door.middle for door in layers(session.scans, session.poses).doors if door.sure]
    places = transform_points(Pose2.of(start), np.array(found).reshape(-1, 2))
    near = np.hypot(*(places[:, None] - doors).transpose(2, 0, 1)) < NEAR
    return f"doors: {near.any(axis=1).sum()} of {len(found)} right"


def main(seeds: range) -> None:
    """Print a row for each environment."""
    for env, steps in STEPS.items():
        drives = [record_path(env, seed, max_episode_steps=steps) for seed in seeds]
        doors = [middles(env, seed, "moving", {}) for seed in seeds]
        for drive, true in zip(drives, doors, strict=True):
            whole, truth = part(drive, (0, 1))
            print(f"    whole drive, {_sure(whole, truth[0], true)}", flush=True)
        pairs = [(*one, shares) for one in zip(drives, doors, strict=True) for shares in PARTS]
        print(env, dict(Counter(outcome(drive, how, true) for drive, true, how in pairs)))
        if env == "DoorLoop-v0":
            continue  # all loops have the same plan
        wholes = [part(one, (0, 1))[0] for one in drives[:5]]
        print("  other buildings", dict(Counter(_refused(*two) for two in permutations(wholes, 2))))


def _refused(first: Session, other: Session) -> str:
    try:
        merged(first, other)
    except InputError:
        return "refused"
    return "merged"


if __name__ == "__main__":
    main(range(int(sys.argv[1]), int(sys.argv[2]) + 1))
