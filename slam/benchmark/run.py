"""Running one variant on one episode: poses, map, and time of each update."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from slam.algorithms.ceilings import CEILINGS
from slam.benchmark.revisions import Revisions
from slam.episode import Episode
from slam.geometry import Array, Pose2
from slam.grid import OccupancyGrid
from slam.interface import Estimate, Revising, Slam, believed
from slam.kernel import READYING
from slam.registry import make

WARM_UP_SCANS = 30


@dataclass(frozen=True)
class Run:
    """The result of a SLAM on the scans of an episode.

    poses      (n, 3) at each scan, as estimated at the end
    online     (n, 3) at each scan, as estimated then; differs from `poses` for a `Revising` SLAM,
               and where the first scans were mapped again
    grid       the map after the last scan
    matched    number of scans that were matched
    spent      (n,) s, wall time of each update, without that of compiling and loading kernels; the
               last one includes `finish`
    lost       (n,) probability that the online pose is off within its map: see `Estimate.lost`
    drift      (n,) m, by which a drift was taken out of the online pose: see `Estimate.drift`
    revisions  (k, 3) arrays: poses of the first k scans, each time that the k-th made the SLAM move
               earlier ones, as where a loop closes; of a run by `run`
    """

    poses: Array
    online: Array
    grid: OccupancyGrid
    matched: int
    spent: Array
    lost: Array
    drift: Array
    revisions: tuple[Array, ...] = ()

    @property
    def seconds(self) -> float:
        """Wall time of all updates."""
        return float(self.spent.sum())

    @property
    def ms_per_matched_scan(self) -> float:
        """Total wall time divided by the number of matched scans (of all scans if none was), ms."""
        return 1e3 * self.seconds / (self.matched or len(self.poses) or 1)


class Playback:
    """Runs a SLAM on an episode scan by scan; `result` gives the run so far at any time."""

    def __init__(self, slam: Slam, episode: Episode):
        self.slam = slam
        self.episode = episode
        self._poses: list[Pose2] = []
        self._matched = 0
        self._spent: list[float] = []
        self._lost: list[float] = []
        self._drift: list[float] = []

    def __iter__(self) -> Iterator[Estimate]:
        """One estimate a scan; the last one after `finish` of a `Revising` SLAM."""
        motions, last = self.episode.displacements(), len(self.episode.scans)
        for k, (motion, scan) in enumerate(zip(motions, self.episode.scans, strict=True), 1):
            own = scan.bare()  # what a SLAM computes of it is freed with it
            begun, readied = time.perf_counter(), READYING.seconds
            estimate = self.slam.update(motion, own)
            if k == last and isinstance(self.slam, Revising):
                self.slam.finish()
            taken = time.perf_counter() - begun
            self._spent.append(taken - (READYING.seconds - readied))
            self._poses.append(estimate.pose)
            self._lost.append(float(estimate.lost))
            self._drift.append(estimate.drift)
            self._matched += bool(estimate.matched)  # a numpy bool would change the sum's type
            yield estimate

    @property
    def done(self) -> int:
        """Number of scans so far."""
        return len(self._poses)

    def result(self) -> Run:
        """The run so far."""
        online = np.array(self._poses).reshape(-1, 3)
        poses = believed(self.slam, online)
        spent, lost, drift = (np.array(told) for told in (self._spent, self._lost, self._drift))
        return Run(poses, online, self.slam.map(), self._matched, spent, lost, drift)


def run(slam: Slam, episode: Episode) -> Run:
    """Run `slam` over the whole episode."""
    playback, revisions = Playback(slam, episode), Revisions(slam)
    for estimate in playback:
        if playback.done < len(episode.scans):  # the last one comes after `finish`
            revisions.take(estimate)
    return replace(playback.result(), revisions=tuple(revisions.poses))


def build(variant: str, episode: Episode, seed: int = 0) -> Slam:
    """A new SLAM by name, to be run on `episode`: a variant from the true start, or a ceiling.

    Raises InputError for an unknown name, and for a ceiling if the episode does not hold the truth.
    """
    if variant not in CEILINGS:
        return make(variant, true_start(episode), seed)
    truth = episode.known_truth(repr(variant))
    return CEILINGS[variant](truth, np.random.default_rng(seed))


def warm_up(variant: str, episode: Episode) -> None:
    """Compile the kernels of `variant` (numba, cached on disk), before its time is measured."""
    slam = build(variant, episode)
    for motion, scan in zip(episode.displacements(), episode.scans[:WARM_UP_SCANS], strict=False):
        slam.update(motion, scan)


def true_start(episode: Episode) -> Pose2:
    """The true pose at the first scan; the origin where the truth is not known."""
    return Pose2() if episode.truth is None else Pose2.of(episode.truth.poses[0])
