"""Other places at which the robot may be, instead of the believed one."""

from __future__ import annotations

import math
from typing import NamedTuple

from slam.geometry import Pose2
from slam.graph.local_map import Keyframe
from slam.recovery.lost_belief import LostBelief
from slam.recovery.places import CANDIDATES, Place, Places, agree, at, best_near, matched
from slam.scan import Scan
from slam.sensor_models.endpoint import Endpoint

LEAST_USUAL = 0.6  # share of explained echoes: a map that usually explains less proves no place
MORE_EXPLAINED = 0.1  # share of the echoes, at least, that are explained there and not here
BEGAN_GAIN = 0.055  # nats a beam by which the scan with which a doubt began fits better there
BEGAN_EXPLAINED = 0.2  # or share of its surface that is explained there and not here
MAX_SEARCHES, SEARCH_SPACING = 6, 30  # of the whole map in a row; keyframes for one more


class Proof(NamedTuple):
    """What is asked of another place before it speaks against the believed one.

    gain          nats a beam by which it must explain a scan better
    explained     of the usual share of explained echoes, at least
    spreads       usual deviations of that share by which it must explain more
    contradicted  share of the echoes, at most
    candidates    of a search
    """

    gain: float
    explained: float
    spreads: float
    contradicted: float
    candidates: int


AFTER_JUMP = Proof(0.04, 0.7, 0.0, 0.2, CANDIDATES)  # after a scan that was not continuous
WITHOUT_JUMP = Proof(0.12, 0.85, 3.0, 0.12, 1)
NEARBY = Proof(0.12, 0.85, 3.0, 0.2, 1)  # after such a scan, within reach of wheels that slipped,
SLIPPED = 1.0, 1.0, math.radians(30.0)  # m, m, rad,
LESS_CONTRADICTED = 0.1  # share of the echoes, at least, that are contradicted here and not there


class Rivals:
    """Searches the whole map for another place, and counts the scans in a row that speak for it.

    A robot that was carried is at the other place from the scan that was not continuous on, which
    must fit better there, too: new ground that looks like the place explains only later scans.

    votes  scans in a row
    """

    def __init__(self) -> None:
        self.votes = 0
        self._searches = float(MAX_SEARCHES)  # that may be made now
        self._way: Pose2 | None = None  # from the believed place to the other, by the last one

    def keyframe(self) -> None:
        """Count a keyframe: searches of the whole map are rationed."""
        self._searches = min(self._searches + 1.0 / SEARCH_SPACING, MAX_SEARCHES)

    def vote(
        self,
        endpoint: Endpoint,
        scan: Scan,
        here: Place,
        belief: LostBelief,
        proof: Proof,
        jump: Keyframe | None,
    ) -> bool:
        """Whether a place other than `here` explains the scan much better. It counts in a row only
        if the scan before was for the same one.

        jump  the scan with which the doubt began, and its pose from here, if it counts
        """
        other = None if jump is None else self._nearby(endpoint, scan, here, belief)
        if other is None:
            other = self._other(endpoint, scan, here, belief, proof)
            if other is None:
                return False
            if jump is not None and not _began(endpoint, here, other, jump):
                self._way = None
                return False
        before, self._way = self._way, other.pose @ here.pose.inverse()
        same = before is not None and agree(self._way @ here.pose, before @ here.pose)
        self.votes = self.votes + 1 if same else 1
        return True

    def _nearby(
        self, endpoint: Endpoint, scan: Scan, here: Place, belief: LostBelief
    ) -> Place | None:
        """A place that the robot may have slipped to, and may still have done after the doubt
        began. The map contradicts the believed one: it is not new ground."""
        if here.agreement.contradicted < LESS_CONTRADICTED:
            return None
        place = matched(endpoint, scan, best_near(endpoint, scan, here.pose, SLIPPED))
        less = here.agreement.contradicted - place.agreement.contradicted
        better = place.value > here.value + NEARBY.gain * len(scan.points)
        meets = _meets(place, _least(here, belief, NEARBY), NEARBY)
        return place if better and meets and less > LESS_CONTRADICTED else None

    def _other(
        self, endpoint: Endpoint, scan: Scan, here: Place, belief: LostBelief, proof: Proof
    ) -> Place | None:
        """The place that the last scan was for, or another one of the whole map."""
        gain = proof.gain * len(scan.points)
        more = _more(here, belief, proof)
        if self.votes and self._way is not None:
            before = matched(endpoint, scan, self._way @ here.pose)
            if before.value > here.value + gain and _meets(before, more, proof):
                return before
        if self._searches < 1.0:
            return None
        self._searches -= 1.0
        least = _least(here, belief, proof)
        places = Places(endpoint, here.pose, candidates=proof.candidates)
        other = places.better_than(scan, here, gain, least)
        return other if other is not None and _meets(other, least, proof) else None


def _more(here: Place, belief: LostBelief, proof: Proof) -> float:
    """The share of echoes that must be explained elsewhere, to be more than `here`."""
    return here.agreement.explained + max(MORE_EXPLAINED, proof.spreads * belief.spread)


def _least(here: Place, belief: LostBelief, proof: Proof) -> float:
    """The share that must be explained there, to be as much as usual, too."""
    return max(proof.explained * max(belief.explained, LEAST_USUAL), _more(here, belief, proof))


def _began(endpoint: Endpoint, here: Place, other: Place, jump: Keyframe) -> bool:
    """Whether the scan with which the doubt began fits better at the other place, as well."""
    before = at(endpoint, jump.scan, here.pose @ jump.pose)
    there = matched(endpoint, jump.scan, other.pose @ jump.pose)
    more = there.agreement.explained - before.agreement.explained
    gain = there.value - before.value
    return gain > BEGAN_GAIN * len(jump.scan.points) or (gain > 0.0 and more > BEGAN_EXPLAINED)


def _meets(place: Place, explained: float, proof: Proof) -> bool:
    """Whether the map explains so much of the scan at a place, and contradicts little of it."""
    agreement = place.agreement
    return agreement.explained > explained and agreement.contradicted <= proof.contradicted
