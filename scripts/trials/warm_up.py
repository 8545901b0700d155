"""Jobs that compile kernels, in parts that processes share: numba keeps the result on disk."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from slam.benchmark.results import Result
from slam.episode import Episode
from slam.geometry import Pose2
from slam.graph.local_map import LocalMap
from slam.graph.loops import Loops, Matcher
from slam.maps.static import Static
from slam.recovery.places import matched
from slam.scan import Scan
from slam.sensor_models.endpoint import Endpoint
from slam.trajectory import Trajectory

from .jobs import Done, Job, Trial
from .sources import SimulatedDrive, Source

STEPS = 5  # of a simulated drive
SCANS = 40  # in the room
LENGTH, WIDTH = 10.0, 4.0  # m, of the room
MAX_RANGE = 8.0  # m, of the laser
STEP = 0.03  # m, from scan to scan
TURN = 0.3  # rad, likewise, in the second half: turns that fast take another search
LIMIT = 600.0  # s, of a job
FIRST_VARIANT = "static-ml"  # shares most kernels with the others


def warm_up_jobs(worlds: Sequence[str], variants: Sequence[str]) -> list[Job]:
    """Jobs that compile the kernels of worlds, scores and variants, in an order in which two
    processes seldom wait for each other: the first variant takes as long as the simulator and the
    search, with which it has hardly any in common."""
    drives = [
        Trial("warm-up", {}, SimulatedDrive(world, 0, {"max_episode_steps": STEPS}), "odometry",
              limit=LIMIT) for world in worlds
    ]  # fmt: skip
    ordered = sorted(variants, key=lambda name: name != FIRST_VARIANT)
    runs = [Trial("warm-up", {}, Room(), name, limit=LIMIT) for name in ordered]
    search = [CompileLoopSearch()] if FIRST_VARIANT in variants else []
    return [*drives[:1], *runs[:1], *search, *runs[1:], *drives[1:]]


@dataclass(frozen=True)
class CompileLoopSearch:
    """Match one scan with the map of itself, as for a loop, and as of a lost robot: the kernels
    that take longest to compile, and that the room is too small for."""

    limit: float = LIMIT

    def __call__(self) -> Done:
        """Do it."""
        scan = Room().make().scans[0]
        place, endpoint, drawn = LocalMap((), scan), Endpoint(), Static()
        covariance = np.diag([0.1, 0.1, 0.02]) ** 2
        Matcher(Loops()).match(place, place.panorama(), Pose2(), covariance)
        endpoint.refresh(drawn, drawn.integrate(scan, Pose2()))
        matched(endpoint, scan, Pose2())
        return Done(self.row())

    def row(self) -> Result:
        """The name alone: to compile is no result."""
        return {"variant": "loop search"}


@dataclass(frozen=True)
class Room(Source):
    """A drive of SCANS scans in an empty room, without the simulator: ahead and then turning, after
    the robot stood for a scan, which no SLAM matches."""

    seed: int = 0

    def plain(self) -> dict[str, Any]:
        """The room is always the same."""
        return {"room": [LENGTH, WIDTH]}

    def make(self) -> Episode:
        """Compute the scans."""
        times = 0.1 * np.arange(float(SCANS))
        ahead = np.arange(SCANS) < SCANS / 2
        moves = np.arange(SCANS) != 1
        x = np.cumsum(np.where(ahead & moves, STEP, 0.0))
        theta = np.cumsum(np.where(ahead, 0.0, TURN))
        poses = np.column_stack([x, 0 * x, theta])
        scans = tuple(_scan(*pose) for pose in np.column_stack([x, theta, times]).tolist())
        return Episode(scans, Trajectory(times, poses))


def _scan(x: float, theta: float, time: float) -> Scan:
    angles = np.linspace(-math.pi / 2, math.pi / 2, 181)
    along, aside = np.cos(angles + theta), np.sin(angles + theta)
    ends = np.where(along > 0, LENGTH / 2 - x, -LENGTH / 2 - x)
    along, aside = np.where(along == 0, 1e-9, along), np.maximum(np.abs(aside), 1e-9)
    ranges = np.minimum(ends / along, WIDTH / 2 / aside)
    return Scan(np.where(ranges < MAX_RANGE, ranges, math.inf), angles, MAX_RANGE, time=time)
