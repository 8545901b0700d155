"""PlaceDoors: the doors that a robot suspects in a place, and its belief about each of them."""

from __future__ import annotations

import math
from functools import cache

import numpy as np

from dynslam_env.navigation.door_belief import DoorBelief, spread
from dynslam_env.patrol.door_looks import looked
from dynslam_env.patrol.door_shapes import suspects
from dynslam_env.patrol.dwell_laws import (
    PRIOR_WEIGHT,
    DoorFilter,
    DwellLaws,
    dwell_laws,
    responsibilities,
    with_still,
)
from slam.geometry import Array, Pose2
from slam.scan import Scan

SAME_DOOR = 0.4  # m between the middles of one doorway seen twice
SAME_DIRECTION = 0.35  # rad
MIN_SIGHTINGS = 3  # scans that show the shape, before a door is suspected
MIN_LEAF_SIGHTINGS = 3  # of a leaf, open or closed: certainly a door
MIN_LEAF_SHARE = 0.05  # sightings of a leaf over looks; fewer: furniture looked like a leaf
MEMORY = 50  # sightings that the mean place of a doorway remembers
MIN_BEAMS = 4  # that reach a doorway, for a look
MAX_SENSOR_DISTANCE = 8.0  # m
CLOSED_SHARE, OPEN_SHARE = 0.8, 0.4  # of the beams that end at the doorway
CONFIRMING = 0.6  # s within which a second look of the same state confirms it
LOOK_ODDS = 30.0  # of a look that is not yet confirmed
STILL_WITH_LEAF = 0.03  # P(a door never flips), if its leaf was seen
BARE_STILL_DOORS, BARE_DOORS = 0.5, 1.0  # prior counts of doorways without a leaf, and of all
DRIFT_AGES = np.array([0.0, 0.5, 1, 2, 3, 5, 8, 12, 20, 30, 50, 80, 120, 200, 300, 500, 800])  # s
REFRESH = 1.0  # s between two estimates of the shared weights of the laws
DRIFT_REFRESH = 10.0  # s between two computations of the drift of doors that were not recognised


class SuspectedDoor:
    """A doorway that may have a leaf.

    place      (4,) x, y of the middle, m; direction of the wall, rad; width, m
    sightings  scans that showed its shape
    looks      scans whose beams reached it
    leaves     sightings of its leaf, in the gap or open; a look that confirms that it closed again
               counts as MIN_LEAF_SIGHTINGS
    filter     of its state
    """

    def __init__(self, row: Array, laws: DwellLaws):
        self.place = row[:4].copy()
        self.sightings, self.looks, self.leaves = 0, 0, 0
        self.filter = DoorFilter(laws)
        self.pending: tuple[float, float] | None = None  # time and odds of being closed
        self.own: tuple[object, Array] | None = None  # see `PlaceDoors._own`
        self.see(row)

    def see(self, row: Array) -> None:
        """Add a row of `suspects`: the mean place moves towards it."""
        self.sightings += 1
        self.leaves += int(row[4])
        share = 1.0 / min(self.sightings, MEMORY)
        turn = np.array([1.0, 1.0, 0.0, 1.0]) * (row[:4] - self.place)
        turn[2] = _turn(self.place[2], row[2])
        self.place += share * turn

    def near(self, x: float, y: float, direction: float) -> bool:
        """Whether a doorway with this middle, m, and direction, rad, is this one."""
        apart = math.hypot(self.place[0] - x, self.place[1] - y)
        return apart < SAME_DOOR and abs(_turn(self.place[2], direction)) < SAME_DIRECTION

    def distance(self, pose: Pose2) -> float:
        """m, from its middle to a pose."""
        return math.hypot(self.place[0] - pose.x, self.place[1] - pose.y)

    def look(self, time: float, share: float) -> None:
        """Add the share of a scan's beams that ended at the doorway; a state counts once it is
        confirmed."""
        if OPEN_SHARE < share < CLOSED_SHARE:
            self.pending = time, 1.0
            return
        closed = share >= CLOSED_SHARE
        odds = LOOK_ODDS if closed else 1.0 / LOOK_ODDS
        if self.pending and self.pending[1] == odds and time - self.pending[0] <= CONFIRMING:
            self.filter.look(time, closed)
            self.leaves += closed * MIN_LEAF_SIGHTINGS if self.filter.flips else 0
        self.pending = time, odds

    def hinted(self, closed: float, time: float) -> float:
        """P(closed at `time`), s: `closed`, which confirmed looks give, with the pending look."""
        if self.pending and time - self.pending[0] <= CONFIRMING:
            return _after(closed, self.pending[1])
        return closed

    @property
    def seen(self) -> bool:
        """Whether its state was ever seen."""
        return self.filter.time is not None

    @property
    def has_leaf(self) -> bool:
        """Whether it counts as a door with a leaf: it flipped, or a leaf was seen often enough."""
        enough = max(MIN_LEAF_SIGHTINGS, MIN_LEAF_SHARE * self.looks)
        return self.filter.flips > 0 or self.leaves >= enough


class PlaceDoors:
    """All suspected doors of a place, and the laws that they share."""

    def __init__(self) -> None:
        self.laws = dwell_laws()
        self.doors: list[SuspectedDoor] = []
        self.weights, self.still = self.laws.prior, BARE_STILL_DOORS / BARE_DOORS
        self._refreshed, self._drifted = -math.inf, 0.0  # s, when they were
        self._drift = _first_drifts()

    def look(self, scan: Scan, pose: Pose2) -> None:
        """Add a scan at `pose`: new shapes, and the states of the doorways in view."""
        for row in suspects(scan, pose):
            self._see(row)
        near = [door for door in self.doors if door.distance(pose) <= MAX_SENSOR_DISTANCE]
        shown = looked(scan, pose, np.array([door.place for door in near]).reshape(-1, 4))
        for door, (reached, ended, leaf, towards) in zip(near, shown.tolist(), strict=True):
            door.leaves += leaf
            if reached >= MIN_BEAMS:
                door.looks += 1
                door.look(scan.time, ended / reached)
            elif towards:
                door.look(scan.time, 0.0)

    def known(self) -> list[SuspectedDoor]:
        """The doors with enough sightings."""
        return [door for door in self.doors if door.sightings >= MIN_SIGHTINGS]

    def closed(self, door: SuspectedDoor, time: float) -> float:
        """P(closed at `time`), s, of a suspected door."""
        self._refresh(time)
        return door.hinted(float(self._own(door) @ door.filter.closed(time)), time)

    def beliefs(self, time: float) -> list[DoorBelief]:
        """What is believed of each known door at `time`, s, and forecast from then on."""
        return [self._belief(door, time) for door in self.known()]

    def _belief(self, door: SuspectedDoor, time: float) -> DoorBelief:
        self._refresh(time)
        expected, own = door.filter.expected(time), self._own(door)
        closed = door.hinted(float(own @ expected.closed), time)
        looked = responsibilities(expected.evidence, self._prior(door))
        after = [w @ each for w, each in zip(looked, expected.looked, strict=True)]
        fresh = (1.0 - closed) * spread(after[0]) + closed * spread(after[1])
        stale = spread(own @ expected.forecast)
        stale[0] = closed * (1.0 - closed)  # it counts a look that is not yet confirmed
        age = math.inf if door.filter.time is None else time - door.filter.time
        return DoorBelief(door.place.copy(), closed, age, door.has_leaf, stale, fresh)

    def drifted(self, closed: Array, ages: Array, time: float) -> Array:
        """(n,) P(closed at `time`) where P was `closed` (n,) `ages` (n,) s ago, of doors that were
        not recognised: as a new door of this place."""
        self._refresh(time)
        was_open, was_closed = (np.interp(ages, DRIFT_AGES, row) for row in self._drift)
        return was_open + closed * (was_closed - was_open)

    def _see(self, row: Array) -> None:
        for door in self.doors:
            if door.near(row[0], row[1], row[2]):
                door.see(row)
                return
        self.doors.append(SuspectedDoor(row, self.laws))

    def _own(self, door: SuspectedDoor) -> Array:
        """(h,) P(law | looks) of a door, anew after a look and after each `_refresh`."""
        state = door.filter.time, door.has_leaf, self._refreshed
        if door.own is None or door.own[0] != state:
            door.own = state, responsibilities(door.filter.evidence, self._prior(door))
        return door.own[1]

    def _prior(self, door: SuspectedDoor) -> Array:
        """(h,) weights of the laws for a door; with a leaf it is hardly one that never flips."""
        return with_still(self.weights, STILL_WITH_LEAF if door.has_leaf else self.still)

    def _refresh(self, time: float) -> None:
        """Estimate the shared weights anew, once every REFRESH s: one step of EM."""
        if time < self._refreshed + REFRESH:
            return
        self._refreshed = time
        doors = [door for door in self.known() if door.seen]
        rows = [door.filter.evidence for door in doors], [self._prior(door) for door in doors]
        shares = responsibilities(*np.array(rows)) if doors else ()
        total = PRIOR_WEIGHT * self.laws.prior
        still, bare = BARE_STILL_DOORS, BARE_DOORS
        for door, share in zip(doors, shares, strict=True):
            if door.has_leaf:
                total[:-1] += share[:-1]
            else:
                still, bare = still + share[-1], bare + 1.0
        self.weights, self.still = total / total.sum(), still / bare
        if time >= self._drifted + DRIFT_REFRESH:
            self._drift, self._drifted = self._drifts(), time

    def _drifts(self) -> Array:
        """(2, a) P(closed) of a new door, DRIFT_AGES s after it was seen open, and closed."""
        return _drifts_by(with_still(self.weights, STILL_WITH_LEAF))


@cache
def _first_drifts() -> Array:
    """(2, a) those of every place at first; they cannot be written to."""
    drifts = _drifts_by(with_still(dwell_laws().prior, STILL_WITH_LEAF))
    drifts.flags.writeable = False
    return drifts


def _drifts_by(weights: Array) -> Array:
    """(2, a) see `PlaceDoors._drifts`, for weights (h,) of the laws."""
    found = np.empty((2, len(DRIFT_AGES)))
    for row, (evidence, later) in zip(found, _seen_once(), strict=True):
        own = responsibilities(evidence, weights)
        row[:] = [own @ closed for closed in later]
    return found


@cache
def _seen_once() -> list[tuple[Array, Array]]:
    """Of a new door that was seen open, and of one seen closed: evidence (h,), and (a, h) P(closed)
    DRIFT_AGES s later, by each law; the same for all places."""
    doors = [DoorFilter(dwell_laws()) for _ in range(2)]
    for door, closed in zip(doors, (False, True), strict=True):
        door.look(0.0, closed)
    return [(door.evidence, np.array([door.closed(a) for a in DRIFT_AGES])) for door in doors]


def _turn(a: float, b: float) -> float:
    """rad from direction `a` to `b`, of lines: -pi/2 to pi/2."""
    return math.remainder(b - a, math.pi)


def _after(p: float, odds: float) -> float:
    """Bayes' rule: `p` after evidence of these odds."""
    return odds * p / (odds * p + 1.0 - p)
