"""Mapping with known poses, for figures 1 to 3, which compare maps without errors of the poses."""

from __future__ import annotations

from collections.abc import Iterator

from slam.algorithms.maximum_likelihood import MaximumLikelihood
from slam.episode import Episode, Truth
from slam.errors import InputError
from slam.geometry import Pose2
from slam.registry import make


def blank(variant: str) -> MaximumLikelihood:
    """A new SLAM of a variant. Raises InputError if it is not a maximum likelihood SLAM."""
    slam = make(variant)
    if not isinstance(slam, MaximumLikelihood):
        raise InputError(f"the figures need a maximum likelihood variant, {variant!r} is none")
    return slam


def mapping(slam: MaximumLikelihood, episode: Episode) -> Iterator[int]:
    """Integrate the keyframes at their true poses; yields the number of each just before."""
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
    """The variant with all keyframes before scan number `until` (default: all) in its map."""
    slam = blank(variant)
    for number in mapping(slam, episode):
        if until is not None and number >= until:
            break
    return slam


def known(episode: Episode) -> Truth:
    """The truth. Raises InputError without one."""
    if episode.truth is None:
        raise InputError("this figure needs an episode with the truth, got one without")
    return episode.truth


def true_poses(episode: Episode) -> list[Pose2]:
    """The true pose of each scan."""
    return [Pose2.of(pose) for pose in known(episode).poses]
