"""Two sessions of parts of a place that overlap, as one.

The other session is cut into stretches. Each is searched for in the whole map of the first one, and
proposes where the other's frame lies there; the proposal counts that most stretches agree with.
Then the stretches that the first map shows are matched with it, and a pose graph of all stretches
takes up what the two maps differ by; and once more with shorter ones, so that no wall is left
double by some centimetres. The first map stays where it is.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from slam.errors import InputError
from slam.geometry import Array, Pose2, between, compose, near
from slam.graph.edges import Edge, Edges
from slam.graph.loops import Loops, cautious, tempered
from slam.graph.pose_graph import PoseGraph
from slam.maps.clamped import Clamped
from slam.recovery.places import best_near, matched
from slam.search.laplace import wide_information
from slam.sensor_models.endpoint import Endpoint
from slam.sessions.door_memory import joined, moved_doors
from slam.sessions.placing import check_certain, not_enough, placed, proposal, told
from slam.sessions.pruning import pruned
from slam.sessions.relocalisation import drawn
from slam.sessions.session import Session, is_dated
from slam.sessions.stretches import LENGTH, Stretch, stretches

COMPARED = 40  # stretches, at most, that are searched for in the whole map
ROUNDS = 4  # of matching: each begins where the one before moved the stretches to
NEIGHBOURS = 3  # stretches before it that the pose of each is known relative to
PLACED = np.diag([0.3, 0.3, math.radians(3.0)]) ** 2  # m^2, rad^2: error of the place found
FLOOR = Loops().floor  # m, m, rad: standard deviations of the errors that a match does not tell


class Fit(NamedTuple):
    """How stretches are fitted to the first map.

    length  m of path of a stretch
    reach   m, m, rad: how far from its expected place one is looked for
    within  m, m, rad: standard deviations of a stretch's pose relative to its neighbours'
    """

    length: float
    reach: tuple[float, float, float]
    within: tuple[float, float, float]


COARSE = Fit(LENGTH, (0.7, 0.7, math.radians(8.0)), (0.08, 0.08, math.radians(1.0)))
FINE = Fit(2.0, (0.15, 0.15, math.radians(3.0)), (0.04, 0.04, math.radians(1.0)))


class Merger(NamedTuple):
    """Two sessions as one, and how sure that is.

    session    both; the first one's poses are as they were
    place      of the other session's frame in that of the first
    shown      stretches of the other one that the first map shows there, less those that it
               contradicts
    rival      the same of the best other place; 0 if there is none, or the place was given
    stretches  of the other one that were compared
    tied       stretches, of all, that were matched with the first map
    bent       m, the farthest that this moved a scan of the other away from `place`
    """

    session: Session
    place: Pose2
    shown: int
    rival: int
    stretches: int
    tied: int
    bent: float


def merged(session: Session, other: Session, given: Pose2 | None = None) -> Merger:
    """Both sessions in the frame of the first one.

    given  about where the other session's frame lies there; None: it is searched for

    A scan that both have is kept once, where the first one has it.

    Raises InputError if the other one does not overlap with the first one's map, or at several
    places, or if all its scans are in the first one.
    """
    new = _new(session, other)
    if not new.any():
        raise InputError("all its scans are in the first one already")
    reading, parts = drawn(session, Clamped()), list(stretches(other))
    evenly = np.linspace(0, len(parts) - 1, min(len(parts), COMPARED)).round()
    chosen = [parts[k] for k in np.unique(evenly).astype(int).tolist()]
    best, rival = (
        placed(reading, chosen) if given is None else (proposal(reading, chosen, given), None)
    )
    poses, tied = _fitted(reading, parts, compose(best.place, other.poses), COARSE)
    if given is None:
        check_certain(best, rival, tied, len(chosen))
    elif min(best.shown, tied) < 1:
        raise InputError(not_enough(len(chosen), min(best.shown, tied), 1))
    shorter = list(stretches(replace(other, poses=poses), FINE.length))
    poses, _ = _fitted(reading, shorter, poses, FINE)
    bent = float(np.hypot(*(poses - compose(best.place, other.poses))[:, :2].T).max())
    doors = joined(session.doors, moved_doors(other.doors, other.poses, poses), bool(new.all()))
    both = replace(_in_order(session, replace(other, poses=poses).kept(new)), doors=doors)
    elsewhere = 0 if rival is None else max(rival.shown, 0)
    return Merger(pruned(both), best.place, best.shown, elsewhere, len(chosen), tied, bent)


def _new(session: Session, other: Session) -> np.ndarray:
    """(n,) bool: the scans of the other session that the first one does not have."""
    known = {(scan.time, scan.ranges.tobytes()) for scan in session.scans}
    return np.array([(scan.time, scan.ranges.tobytes()) not in known for scan in other.scans])


def _fitted(
    reading: Endpoint, parts: Sequence[Stretch], poses: Array, fit: Fit
) -> tuple[Array, int]:
    """The poses of the scans in the first session's frame, given about (n, 3), and how many of the
    stretches are tied to it."""
    begins, tied = poses[[part.numbers[0] for part in parts]], 0
    within = [_edge(0, 1, Pose2.of(begins[0]), PLACED), *_edges_within(begins, fit)]
    for _ in range(ROUNDS):
        starts = [Pose2.of(pose) for pose in begins]
        ties = [_tie(reading, part, start, fit) for part, start in zip(parts, starts, strict=True)]
        edges = [
            Edge(0, k, tie[0], tie[1], loop=True)
            for k, tie in enumerate(ties, 1)
            if tie is not None
        ]
        graph = PoseGraph(np.vstack([np.zeros(3), begins]), Edges([*within, *edges]))
        graph.optimise()
        begins, before = graph.poses[1:], tied
        tied = int((graph.trust()[len(within) :] > 0.5).sum())
        if tied <= before:
            break
    moved = np.empty_like(poses)
    for part, pose in zip(parts, begins, strict=True):
        within_part = between(poses[part.numbers[:1]], poses[part.numbers])
        moved[part.numbers] = compose(Pose2.of(pose), within_part)
    return moved, tied


def _edges_within(begins: Array, fit: Fit) -> Iterator[Edge]:
    """What is known of the stretches' poses (n, 3) relative to their neighbours before them."""
    covariance = np.diag(fit.within) ** 2
    for k in range(1, len(begins)):
        nearest = np.argsort(np.hypot(*(begins[:k] - begins[k])[:, :2].T), kind="stable")
        for j in sorted({k - 1, *nearest[:NEIGHBOURS].tolist()}):
            displacement = Pose2.of(begins[j]).between(Pose2.of(begins[k]))
            yield _edge(j + 1, k + 1, displacement, covariance)


def _edge(first: int, second: int, displacement: Pose2, covariance: Array) -> Edge:
    information = np.asarray(np.linalg.inv(covariance), dtype=np.float64)
    return Edge(first, second, displacement, information)


def _tie(reading: Endpoint, part: Stretch, start: Pose2, fit: Fit) -> tuple[Pose2, Array] | None:
    """The pose of a stretch in the first session's map, near to where it is expected, and its
    information (3, 3); None if the map does not show it there."""
    if not len(part.scan.points):
        return None
    found = matched(reading, part.scan, best_near(reading, part.scan, start, fit.reach))
    if told(reading, part, found) < 1 or not near(found.pose, start, fit.reach[0], fit.reach[2]):
        return None
    information = cautious(wide_information(reading, part.scan, found.pose))
    return found.pose, tempered(information, found.pose.theta, FLOOR)


def _in_order(one: Session, other: Session) -> Session:
    """The recordings of both: in the order of time, if their stamps are unix time; else those of
    the other one last."""
    times = np.concatenate([one.times, other.times])
    numbers = np.concatenate([one.recordings, other.recordings + one.recordings[-1] + 1])
    _, first, recording = np.unique(numbers, return_index=True, return_inverse=True)
    rank = np.arange(len(first))
    if is_dated(float(times.min())):
        rank[np.argsort(times[first], kind="stable")] = np.arange(len(first))
    order = np.argsort(rank[recording], kind="stable")
    scans = (*one.scans, *other.scans)
    return Session(
        tuple(scans[k] for k in order.tolist()),
        np.vstack([one.poses, other.poses])[order],
        rank[recording][order],
    )
