"""Of each place of a building a few recordings are kept: the first, and the last ones.

So a session is bounded by the size of the building, however often it is visited. With the first
recording of a place its frame stays where it was; with the last ones, what is there now.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.spatial import KDTree

from slam.geometry import Array
from slam.sessions.session import Session

NEWEST = 5  # recordings of a place that are kept beside the first one
SAME_DISTANCE = 1.0  # m, most between two poses of one place, if their headings are equal
SAME_TURN = math.radians(45.0)  # rad, most between their headings, if their positions are equal


def pruned(session: Session, newest: int = NEWEST) -> Session:
    """The session without the scans of each place that an earlier recording shows, and `newest`
    later ones or more."""
    places, numbers = _places(session.poses), session.recordings
    groups = [np.flatnonzero(numbers == number) for number in np.unique(numbers).tolist()]
    trees = [KDTree(places[group]) for group in groups]
    kept = np.ones(len(places), np.bool_)
    earlier = np.empty((0, places.shape[1]))
    for k, group in enumerate(groups):
        later = sum(_near(tree, places[group]).astype(int) for tree in trees[k + 1 :])
        if len(earlier):
            kept[group] = ~(_near(KDTree(earlier), places[group]) & (later >= newest))
        earlier = np.concatenate([earlier, places[group[kept[group]]]])
    return session if kept.all() else session.kept(kept)


def grown(before: Session | None, new: Session) -> Session:
    """A session after one more recording, pruned; the new one alone if there was none before."""
    return new if before is None else pruned(before.followed_by(new.scans, new.poses))


def _places(poses: Array) -> Array:
    """(n, 4) points whose distance is at most 1 where two poses are of the same place."""
    turn = 1.0 / (2.0 * math.sin(SAME_TURN / 2.0))
    heading = np.column_stack([np.cos(poses[:, 2]), np.sin(poses[:, 2])])
    return np.hstack([poses[:, :2] / SAME_DISTANCE, heading * turn])


def _near(tree: KDTree, places: Array) -> np.ndarray:
    """(n,) whether any point of the tree is of the same place."""
    return np.isfinite(tree.query(places, distance_upper_bound=1.0)[0])
