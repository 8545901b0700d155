"""How often parts of one drive are merged rightly, and maps of two buildings refused.

    python -m docs.making.merging FIRST LAST

takes the seeds from FIRST to LAST; docs/saved-maps.md has the table of 71 to 76.
"""

from __future__ import annotations

import sys
from collections import Counter
from itertools import permutations

import numpy as np

from agents import record_path
from slam.benchmark.run import run
from slam.episode import Episode
from slam.errors import InputError
from slam.geometry import Array, Pose2, compose
from slam.registry import make
from slam.sessions.merging import merged
from slam.sessions.session import Session, session_of

STEPS = {"DoorOffice-v0": 1800, "DoorWings-v0": 1500, "DoorLoop-v0": 1200, "DoorCorridor-v0": 600}
PARTS = ((0, 0.6), (0.4, 1)), ((0.45, 1), (0, 0.55)), ((0, 0.45), (0.55, 1))
WRONG = 0.3  # m, median error of the other map's scans


def part(drive: Episode, share: tuple[float, float]) -> tuple[Session, Array]:
    """The session of a part of a drive, and its true poses."""
    begin, end = (round(one * len(drive.scans)) for one in share)
    only = Episode(drive.scans[begin:end], drive.odometry)
    truth = drive.known_truth("a score").poses[begin:end]
    return session_of(only, run(make("dynamic-graph"), only).poses), truth


def outcome(drive: Episode, shares: tuple[tuple[float, float], tuple[float, float]]) -> str:
    """Whether two parts of a drive are merged rightly; told with the median error in m."""
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
    print(f"    off by {error:.3f} m", flush=True)
    return "wrong" if error > WRONG else "merged"


def main(seeds: range) -> None:
    """Print a row for each environment."""
    for env, steps in STEPS.items():
        drives = [record_path(env, seed, max_episode_steps=steps) for seed in seeds]
        print(env, dict(Counter(outcome(one, shares) for one in drives for shares in PARTS)))
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
