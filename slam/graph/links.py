"""Which keyframes are compared: those soon before, and those near by at other times."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from slam.geometry import Array, wrap_angle
from slam.kernel import kernel
from slam.validation import positive, whole


@dataclass(frozen=True)
class Links:
    """The pairs of keyframes that are likely to see the same surfaces.

    before   (k, n): every n-th keyframe is compared with the one k before it. Links over many
             keyframes are fewer, as they cost most of the time when all are solved together
    others   most keyframes of other times that it is compared with, the nearest ones
    within   m, to these
    per_rad  m, that a heading which differs by 1 rad counts as
    apart    least number of keyframes between two of them, so that they are of several visits
    """

    before: tuple[tuple[int, int], ...] = ((1, 1), (2, 1), (4, 1), (8, 1), (16, 2), (32, 4))
    others: int = 6
    within: float = 2.0
    per_rad: float = 0.7
    apart: int = 5

    def __post_init__(self) -> None:
        positive(self, "within", "per_rad")
        whole(self, "others", 0)
        whole(self, "apart", 1)

    def __call__(self, poses: Array) -> np.ndarray:
        """(links, 2) the earlier and the later keyframe of each link, of those at `poses` (n, 3) in
        the order of time."""
        pairs, tree = [], KDTree(poses[:, :2])
        for k, every in self.before:
            later = np.arange(-(-k // every) * every, len(poses), every)
            pairs.append(np.column_stack([later - k, later]))
        soon = max(k for k, _ in self.before)
        for here in range(len(poses)):
            near = np.array(tree.query_ball_point(poses[here, :2], self.within), dtype=np.int64)
            near = near[near < here - soon]
            off = poses[near] - poses[here]
            distance = np.hypot(off[:, 0], off[:, 1])
            distance += self.per_rad * np.abs(wrap_angle(off[:, 2]))
            order = near[np.argsort(distance, kind="stable")]
            chosen = _spread(order, self.others, self.apart)
            pairs.append(np.column_stack([chosen, np.full(len(chosen), here)]))
        return np.concatenate(pairs)


@kernel
def _spread(numbers, most, apart):
    """The first `most` numbers that are at least `apart` from all chosen before them."""
    chosen, n = np.empty(most, np.int64), 0
    for number in numbers:
        if n == most:
            break
        near = False
        for k in range(n):
            near = near or abs(number - chosen[k]) < apart
        if not near:
            chosen[n] = number
            n += 1
    return chosen[:n]
