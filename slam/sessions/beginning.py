"""The first metres of a recording, as one scan that grows with the path."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from slam.algorithms.maximum_likelihood import MaximumLikelihood
from slam.episode import Episode
from slam.geometry import Pose2
from slam.graph.local_map import Keyframe, LocalMap, panorama
from slam.scan import Scan

PATH_LENGTHS = (4.0, 8.0, 16.0, 32.0)  # m of path of the recording that are tried in turn
MIN_GROWTH = 1.5  # of the last part over the one before
MAX_SCANS = 4000  # maximum number of its scans, if the robot hardly moves


class Beginning(NamedTuple):
    """The echoes of the first part of a recording.

    scan    all echoes, as one scan taken at the middle of the path
    middle  where it is taken, relative to the recording's first pose
    length  m, of the path
    """

    scan: Scan
    middle: Pose2
    length: float


def beginnings(episode: Episode) -> Iterator[Beginning]:
    """Ever longer parts of the recording, by PATH_LENGTHS; at last all of a short recording, if it
    is much longer than the part before."""
    local = LocalMap([], episode.scans[0])
    lengths = iter(PATH_LENGTHS)
    length, before = next(lengths), 0.0
    for scan, pose in _keyframes(episode):
        local.add(scan, pose)
        if local.length >= length:
            yield _beginning(local)
            before, length = local.length, next(lengths, None)
            if length is None:
                return
    if local.length >= MIN_GROWTH * before:
        yield _beginning(local)


def _keyframes(episode: Episode) -> Iterator[Keyframe]:
    """The keyframes after the first, at their poses relative to it."""
    front, last = MaximumLikelihood(), None
    for displacement, scan in zip(episode.displacements()[:MAX_SCANS], episode.scans, strict=False):
        front.update(displacement, scan)
        if last is not None and front.keyframe is not last:
            yield Keyframe(scan, front.pose)
        last = front.keyframe


def _beginning(local: LocalMap) -> Beginning:
    middle = local.middle()
    frames = [Keyframe(one.scan, middle.between(one.pose)) for one in local.keyframes]
    return Beginning(panorama(frames), middle, local.length)
