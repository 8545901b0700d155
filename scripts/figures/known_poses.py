"""Mapping with known poses: what a variant's map holds when its robot cannot be lost.

The figures 1 to 3 are about the maps; an error of the poses would blur what they show.
"""

from __future__ import annotations

from collections.abc import Iterator

from slam.algorithms.maximum_likelihood import MaximumLikelihood
from slam.episode import Episode, Truth
from slam.errors import InputError
from slam.geometry import Pose2
from slam.registry import make


def blank(variant: str) -> MaximumLikelihood:
    """A new SLAM of a registered variant; raises InputError if it is no maximum likelihood one."""
    slam = make(variant)
    if not isinstance(slam, MaximumLikelihood):
        raise InputError(f"the figures need a maximum likelihood variant, {variant!r} is none")
    return slam


def mapping(slam: MaximumLikelihood, episode: Episode) -> Iterator[int]:
    """Puts the key scans into the map at their true poses; gives each one's number just before."""
    poses, last = true_poses(episode), 0
    for number, scan in enumerate(episode.scans):
        moved = poses[last].between(poses[number])
        if number and not slam.keyframes.due(moved, scan.time - episode.scans[last].time):
            continue
        yield number
        changed = slam.map_model.integrate(scan, poses[number])
        slam.sensor_model.refresh(slam.map_model, changed)
        last = number


def mapped(variant: str, episode: Episode, until: int | None = None) -> MaximumLikelihood:
    """The variant with all key scans before scan number `until` (default: all) in its map."""
    slam = blank(variant)
    for number in mapping(slam, episode):
        if until is not None and number >= until:
            break
    return slam


def known(episode: Episode) -> Truth:
    """The truth; raises InputError where there is none."""
    if episode.truth is None:
        raise InputError("this figure needs an episode with the truth, got one without")
    return episode.truth


def true_poses(episode: Episode) -> list[Pose2]:
    """One true pose a scan."""
    return [Pose2.of(pose) for pose in known(episode).poses]
