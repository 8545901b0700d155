"""A session in stretches: parts of a few metres of path, each as one scan."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from slam.geometry import Pose2
from slam.graph.local_map import Keyframe, Panorama, panorama
from slam.sessions.session import Session

LENGTH = 6.0  # m of path in a stretch that is searched for in a whole map
JUMP = 1.0  # m between scans of one stretch, at most: scans in between were dropped


class Stretch(NamedTuple):
    """A part of a session.

    pose     of its first scan
    scan     echoes of all its keyframes, as one scan taken there
    numbers  of its scans in the session
    """

    pose: Pose2
    scan: Panorama
    numbers: list[int]


def stretches(session: Session, longest: float = LENGTH) -> Iterator[Stretch]:
    """The session in parts of at most `longest`, m, each of one recording and without jumps."""
    keyframes = {id(scan) for scan, _ in session.keyframes()}
    steps = np.hypot(*np.diff(session.poses[:, :2], axis=0).T)
    begins = (np.diff(session.recordings) > 0) | (steps > JUMP)
    numbers, length = [0], 0.0
    for k in range(1, len(session.scans)):
        length += float(steps[k - 1])
        if begins[k - 1] or length > longest:
            yield _stretch(session, numbers, keyframes)
            numbers, length = [], 0.0
        numbers.append(k)
    yield _stretch(session, numbers, keyframes)


def _stretch(session: Session, numbers: list[int], keyframes: set[int]) -> Stretch:
    first = Pose2.of(session.poses[numbers[0]])
    chosen = [k for k in numbers if id(session.scans[k]) in keyframes] or numbers[:1]
    frames = [Keyframe(session.scans[k], Pose2.of(session.poses[k])) for k in chosen]
    return Stretch(first, panorama([one.seen_from(first) for one in frames]), numbers)
