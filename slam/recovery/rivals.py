"""Other places at which the robot may be, instead of the believed one."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from slam.geometry import Pose2, near
from slam.graph.local_map import Keyframe
from slam.interface import LOST_DISTANCE, LOST_TURN
from slam.recovery.lost_belief import LostBelief
from slam.recovery.places import CANDIDATES, Place, Places, agree, at, best_near, matched
from slam.scan import Scan
from slam.sensor_models.endpoint import Endpoint

LEAST_USUAL = 0.6  # share of explained echoes: a map that usually explains less proves no place
MORE_EXPLAINED = 0.1  # share of the echoes, at least, that are explained there and not here
BEGAN_GAIN = 0.055  # nats a beam by which the scan with which a doubt began fits better there
BEGAN_EXPLAINED = 0.2  # or share of its surface that is explained there and not here,
SINCE_GAIN = 0.3  # or nats a beam by which the scans since then do, all together,
SINCE_EXPLAINED = 0.85  # if so much of the usual share of the first and of the last is explained,
LED_EXPLAINED = 0.1  # and by so much more of the surface of the first one than here,
CLEARLY_LED = 0.3  # or by so much more, though doors that moved there make it fit no better
SUSPECTS = 4  # places, at most, that are compared at each check
MAX_SEARCHES, SEARCH_SPACING = 6, 30  # of the whole map in a row; keyframes for one more


class Proof(NamedTuple):
    """What is asked of another place before it speaks against the believed one.

    gain          nats a beam by which it must explain a scan better
    explained     of the usual share of explained echoes, at least
    spreads       usual deviations of that share by which it must explain more
    contradicted  share of the echoes, at most
    here          of the usual share, at most, that is explained at the believed place
    candidates    of a search
    sure          whether half of the echoes that usually are not explained must be, too, and only
                  the best place of a search counts: where all looks alike, some place always fits
    """

    gain: float
    explained: float
    spreads: float
    contradicted: float
    here: float
    candidates: int
    sure: bool


AFTER_JUMP = Proof(0.04, 0.7, 0.0, 0.2, 1.0, CANDIDATES, False)  # after a scan that changed at once
AFTER_CORRECTION = AFTER_JUMP._replace(gain=0.02)  # after one that was found far away
AFTER_TURN = AFTER_JUMP._replace(gain=0.08, contradicted=0.1, sure=True)  # that only the map tells
AFTER_FADE = AFTER_JUMP._replace(gain=0.03, explained=1.0, contradicted=0.12)  # the same, if it
# only explains less: nearly all is explained at the true place
WITHOUT_JUMP = Proof(0.12, 0.85, 3.0, 0.12, 0.4, 1, False)
NEARBY = AFTER_JUMP._replace(gain=0.1, explained=0.65)  # after a jump, within ...
SLIPPED = 1.0, 1.0, math.radians(30.0)  # m, m, rad, to which the wheels may have slipped, ...
MISMATCHED = 0.3, 0.3, math.radians(15.0)  # m, m, rad, by which a match may have been wrong
LESS_CONTRADICTED = 0.1  # if so large a share of the echoes is contradicted here and not there


class Check(NamedTuple):
    """A scan of a robot that may be elsewhere than it believes.

    endpoint  of the map in which it is searched for
    scan      the last one
    here      the believed place
    belief    knows what is usual
    proof     what is asked of another place
    jump      the scan with which the doubt began, and its pose from here, if it counts
    reach     m, from the believed place, that another one may be apart
    """

    endpoint: Endpoint
    scan: Scan
    here: Place
    belief: LostBelief
    proof: Proof
    jump: Keyframe | None
    reach: float

    @property
    def usual(self) -> float:
        """The share of echoes that the map usually explains."""
        return max(self.belief.explained, LEAST_USUAL)

    @property
    def more(self) -> float:
        """The share of echoes that must be explained elsewhere, to be more than here."""
        more = max(MORE_EXPLAINED, self.proof.spreads * self.belief.spread)
        sure = 0.5 + 0.5 * self.usual if self.proof.sure else 0.0
        return max(self.here.agreement.explained + more, sure)

    @property
    def least(self) -> float:
        """The share that must be explained there, to be as much as usual, too."""
        return max(self.proof.explained * self.usual, self.more)

    def gain(self, place: Place) -> float:
        """Nats a beam by which the scan fits better at another place."""
        return (place.value - self.here.value) / max(len(self.scan.points), 1)

    def speaks_for(self, place: Place, explained: float) -> bool:
        """Whether the scan fits so much better there, the map explains that share of it, and
        contradicts little, and the robot may be there."""
        if math.dist(place.pose[:2], self.here.pose[:2]) > self.reach:
            return False
        agreement = place.agreement
        enough = agreement.explained > explained
        agrees = enough and agreement.contradicted <= self.proof.contradicted
        return agrees and self.gain(place) > self.proof.gain and self._strange_here()

    def _strange_here(self) -> bool:
        """Whether the map explains so little of the scan at the believed place as is asked for."""
        return self.here.agreement.explained <= self.proof.here * self.usual

    def as_usual(self, explained: float) -> bool:
        """Whether the map explains about as much of a scan as usual."""
        return explained > SINCE_EXPLAINED * self.usual

    def began(self, place: Place) -> Beginning:
        """How the scan with which the doubt began fits there."""
        if self.jump is None:
            return Beginning(math.inf, 0.0, 1.0)
        scan, pose = self.jump
        before = self._fitted(scan, self.here.pose @ pose)
        there = matched(self.endpoint, scan, place.pose @ pose)
        gain = (there.value - before.value) / max(len(scan.points), 1)
        explained = there.agreement.explained
        return Beginning(gain, explained - before.agreement.explained, explained)

    def _fitted(self, scan: Scan, pose: Pose2) -> Place:
        """The place of a scan that was matched at a pose, or one nearby if the map shows much more
        of the scan there: the match was wrong, as of a robot that a leaf turns."""
        found = at(self.endpoint, scan, pose)
        nearby = matched(self.endpoint, scan, best_near(self.endpoint, scan, pose, MISMATCHED))
        more = nearby.agreement.explained - found.agreement.explained
        return nearby if more > BEGAN_EXPLAINED else found


class Beginning(NamedTuple):
    """How much better than at the believed place a scan fits, with which a doubt began.

    gain       nats a beam
    more       share of its surface that is explained there and not here
    explained  share that is explained there
    """

    gain: float
    more: float
    explained: float

    def speaks(self, since: float) -> bool:
        """Whether it speaks for the other place; a little is enough if those `since` do, by so many
        nats a beam all together."""
        if self.gain > BEGAN_GAIN:
            return True
        return since > SINCE_GAIN or (self.gain > 0.0 and self.more > BEGAN_EXPLAINED)


@dataclass
class Suspect:
    """A place that may be the true one instead of the believed one.

    way        from the believed place to this one
    gain       nats a beam by which the scans since it was found fit better here, all together
    plausible  whether the scan with which the doubt began does, too, and the last one is explained
               as well as usual
    """

    way: Pose2
    gain: float
    plausible: bool = False


def around(endpoint: Endpoint, scan: Scan, pose: Pose2) -> Place:
    """The likeliest place within SLIPPED of a pose."""
    return matched(endpoint, scan, best_near(endpoint, scan, pose, SLIPPED))


class Rivals:
    """Searches the whole map for another place, and counts the scans that speak for it.

    A robot that was carried is at the other place from the scan that was not continuous on, which
    must fit better there, too: new ground that looks like the place explains only later scans.

    votes  scans for the same place
    """

    def __init__(self) -> None:
        self.votes = 0
        self._searches = float(MAX_SEARCHES)  # that may be made now
        self._way: Pose2 | None = None  # from the believed place to the other, by the last one
        self._suspects: list[Suspect] = []

    def keyframe(self) -> None:
        """Count a keyframe: searches of the whole map are rationed."""
        self._searches = min(self._searches + 1.0 / SEARCH_SPACING, MAX_SEARCHES)

    @property
    def leading(self) -> bool:
        """Whether the scans since the doubt began fit much better at another place, together."""
        return any(suspect.plausible and suspect.gain > SINCE_GAIN for suspect in self._suspects)

    def clear(self) -> None:
        """No other place is suspected any more."""
        self.votes = 0
        self._suspects.clear()

    def vote(self, check: Check) -> bool:
        """Whether another place explains the scan much better. Its vote is added to those before if
        they were for the same place."""
        suspected = self._suspected(check)
        other = self._nearby(check) or suspected or self._found(check)
        if other is None:
            self.votes = 0
            return False
        here = check.here.pose
        before, self._way = self._way, other.pose @ here.inverse()
        same = before is not None and agree(other.pose, before @ here)
        self.votes = self.votes + 1 if same else 1
        return True

    def _nearby(self, check: Check) -> Place | None:
        """A place that the robot may have slipped to, and may still have done after the doubt
        began. The map contradicts the believed one: it is not new ground."""
        contradicted = check.here.agreement.contradicted
        if check.jump is None or contradicted < LESS_CONTRADICTED:
            return None
        check = check._replace(proof=NEARBY)
        place = around(check.endpoint, check.scan, check.here.pose)
        if near(check.here.pose, place.pose, LOST_DISTANCE, LOST_TURN):
            return None
        less = contradicted - place.agreement.contradicted
        speaks = less > LESS_CONTRADICTED and check.speaks_for(place, check.least)
        return place if speaks else None

    def _suspected(self, check: Check) -> Place | None:
        """The likeliest of the places that were found before, if the scan speaks for it."""
        here, best = check.here.pose, None
        for suspect in self._suspects:
            place = matched(check.endpoint, check.scan, suspect.way @ here)
            began = check.began(place)
            suspect.way = place.pose @ here.inverse()
            suspect.gain += check.gain(place)
            if check.jump is not None:
                led = began.more > (LED_EXPLAINED if began.gain > 0.0 else CLEARLY_LED)
                both = min(began.explained, place.agreement.explained)
                suspect.plausible = led and check.as_usual(both)
            since = suspect.gain if suspect.plausible else 0.0
            speaks = check.speaks_for(place, check.more) and began.speaks(since)
            if speaks and (best is None or place.value > best.value):
                best = place
        return best

    def _found(self, check: Check) -> Place | None:
        """The best place of a search of the whole map, if the scan speaks for it, and the one with
        which the doubt began does, too; the best without that one is suspected, if none is."""
        if self._searches < 1.0:
            return None
        self._searches -= 1.0
        here = check.here
        places = Places(check.endpoint, known=True, candidates=check.proof.candidates)
        gain = check.proof.gain * len(check.scan.points)
        found = places.better_than(check.scan, here, gain, check.least)
        found = found[:1] if check.proof.sure else found
        found = [place for place in found if check.speaks_for(place, check.least)]
        begun = next((place for place in found if check.began(place).speaks(0.0)), None)
        if found:
            self._suspect(begun or found[0], check)
        return begun

    def _suspect(self, place: Place, check: Check) -> None:
        """Remember a place, to be compared at the next checks."""
        here = check.here.pose
        if any(agree(suspect.way @ here, place.pose) for suspect in self._suspects):
            return
        self._suspects.append(Suspect(place.pose @ here.inverse(), check.gain(place)))
        self._suspects.sort(key=lambda suspect: -suspect.gain)
        del self._suspects[SUSPECTS:]
