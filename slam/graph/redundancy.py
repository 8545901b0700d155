"""Local maps that others make redundant: of places that the robot has been to often."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from slam.geometry import Array, compose
from slam.graph.local_map import LocalMap
from slam.kernel import kernel

SAME_DISTANCE = 1.0  # m between two poses of the robot from which it sees the same,
SAME_TURN = math.radians(45.0)  # rad, and of their headings
LEAST_SHARE = 0.4  # of the path of a local map, that another one of the same place covers
NEVER = math.inf  # gap in time of a local map that is not forgotten


class Redundancy:
    """Finds the local map to forget, so that few remain of each place, from all times.

    A local map is redundant if the robot was at each pose of its path in `visits` others, too. Of
    those, the one is forgotten that leaves the smallest gap in time between the others of its
    place. The first and the last one of a place stay: with the first the frame that later ones are
    tied to, with the last what has changed there.

    visits  number of other local maps that cover a redundant one
    """

    def __init__(self, visits: int):
        self._visits = visits

    def choice(
        self, places: Sequence[LocalMap], middles: Array, poses: Array, here: int
    ) -> tuple[int, np.ndarray] | None:
        """The number of the local map to forget among those that local map `here` covers in part,
        and the numbers of those that cover it; None if none is redundant.

        middles  (n, 2) m, the centres of all local maps up to `here`, in the world
        poses    (n, 3) their frames
        """
        reach = places[here].length + 2.0 * SAME_DISTANCE  # of those that cover one another
        near = np.flatnonzero(np.hypot(*(middles - middles[here]).T) <= 2.0 * reach)
        if len(near) <= self._visits + 1:
            return None
        paths = [places[k].path() for k in near.tolist()]
        lengths = [len(path) for path in paths]
        world = compose(np.repeat(poses[near], lengths, axis=0), np.concatenate(paths))
        least, shares = _coverage(world, np.cumsum([0, *lengths]))
        same = shares >= LEAST_SHARE
        gaps = [
            _gap(places, near[same[k]], near[k]) if least[k] >= self._visits else NEVER
            for k in range(len(near))
        ]
        k = int(np.argmin(gaps))
        return None if gaps[k] == NEVER else (int(near[k]), near[same[k]])


def _gap(places: Sequence[LocalMap], others: np.ndarray, number: int) -> float:
    """The gap between the local maps before and after one, of those that cover it."""
    if number == 0:
        return NEVER
    earlier, later = others[others < number], others[others > number]
    if not (len(earlier) and len(later)):
        return NEVER
    return places[later.min()].ordinal - places[earlier.max()].ordinal


@kernel
def _coverage(poses, begins):
    """(n,) the least number of other paths that cover a pose of each path, 0 for those that the
    last one does not cover in part; (n, n) the share of the poses of each that each other covers.

    poses   of all paths; those of path k from `begins[k]` to `begins[k + 1]`
    """
    n = len(begins) - 1
    least, shares = np.zeros(n, np.int64), np.zeros((n, n))
    for a in range(n - 1):
        path = poses[begins[a] : begins[a + 1]]
        counts = np.zeros(len(path), np.int64)
        shares[a, n - 1] = _shared(path, poses[begins[n - 1] :], counts)
        if shares[a, n - 1] == 0.0:
            continue
        for b in range(n - 1):
            if b != a:
                shares[a, b] = _shared(path, poses[begins[b] : begins[b + 1]], counts)
        least[a] = counts.min()
    return least, shares


@kernel
def _shared(path, other, counts):
    """The share of the poses of a path that another path covers; each of them is counted."""
    n = 0
    for i in range(len(path)):
        if _covered(path[i], other):
            counts[i] += 1
            n += 1
    return n / len(path)


@kernel
def _covered(pose, path):
    """Whether the robot was at the pose somewhere on a path."""
    for k in range(len(path)):
        dx, dy = path[k, 0] - pose[0], path[k, 1] - pose[1]
        if dx * dx + dy * dy <= SAME_DISTANCE * SAME_DISTANCE:
            turn = abs((path[k, 2] - pose[2] + np.pi) % (2.0 * np.pi) - np.pi)
            if turn <= SAME_TURN:
                return True
    return False
