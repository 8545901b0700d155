"""Where a recording begins in a saved map: found without a guess, or compared with a given one.

The first metres of the recording, as one scan, are searched for in the whole map at all headings
(branch and bound, Hess et al. 2016). Doors and furniture may have changed since, and the laser may
be another: a place is not judged by how much of the scan it explains, but by how much better it
does so than the best other place, in nats of the log-likelihood. While two places fit nearly
equally well, a longer part of the recording is compared.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from slam.episode import Episode
from slam.errors import InputError
from slam.geometry import Pose2
from slam.interface import MapModel
from slam.maps.clamped import Clamped
from slam.recovery.places import Place, Places, at, same_place
from slam.scan import Scan
from slam.sensor_models.endpoint import Endpoint
from slam.sessions.beginning import Beginning, beginnings
from slam.sessions.session import Session

MIN_GAIN = 20.0  # nats by which a place must fit better than the best other one
CONFIRMED_GAIN = 10.0  # the same, if it was also the best place by a shorter part of the path
MIN_EXPLAINED = 0.4  # minimum share of the echoes that lie on something in the map
MAX_CONTRADICTED = 0.35  # maximum share of the echoes that lie in its free space
PARTS = 3  # of the echoes, each of which is searched for


class Comparison(NamedTuple):
    """The places of a map at which a recording may begin; poses are those of its first scan.

    best   the place that fits best
    other  the best place elsewhere
    given  the place near the given start; None if none was given
    path   m of the recording's path that were compared
    again  whether the best place was also the best by a shorter part of the path
    """

    best: Place
    other: Place
    given: Place | None
    path: float
    again: bool = False

    @property
    def gain(self) -> float:
        """Nats by which the best place fits better than the best other one."""
        return self.best.value - self.other.value

    @property
    def fits(self) -> bool:
        """Whether the recording may begin at the best place at all."""
        return fits(self.best)

    @property
    def unique(self) -> bool:
        """Whether the recording begins at the best place, and nowhere else."""
        return self.fits and self.gain >= (CONFIRMED_GAIN if self.again else MIN_GAIN)

    @property
    def given_is_best(self) -> bool:
        """Whether the given start is the best place."""
        return self.given is not None and same_place(self.given.pose, self.best.pose)

    @property
    def given_is_possible(self) -> bool:
        """Whether the map fits at the given start, and nowhere else clearly better."""
        given = self.given
        if given is None or not fits(given):
            return False
        return self.best.value - given.value < MIN_GAIN


class WholeMap(Places):
    """The places of the whole map."""

    def best_two(self, scan: Scan, start: Pose2 | None) -> tuple[Place, Place]:
        """The best place, and the best that is not near it, if the best one fits at all; `start` is
        one of the candidates."""
        given = [] if start is None else [self.matched(scan, start)]
        found = [*given, *self._candidates(scan, [])]
        best = _best(found)
        if not fits(best):  # the recording begins elsewhere: the slow search is of no use
            return best, min(found, key=lambda place: place.value)
        given = [place for place in given if not same_place(place.pose, best.pose)]
        other = _best([*given, *self._candidates(scan, [best.pose])])
        return (best, other) if best.value >= other.value else (other, best)

    def _candidates(self, scan: Scan, but: list[Pose2]) -> list[Place]:
        """The best place by each of PARTS of the echoes: the search is coarse, and by one part
        alone may miss the best place by all."""
        region, places = self._search, []
        for k in range(PARTS):
            start = region.best(scan.points[k::PARTS], region.centre, region.reach, but)
            place = self.matched(scan, start)
            led_back = any(same_place(place.pose, other) for other in but)
            places.append(at(self._endpoint, scan, start) if led_back else place)
        return places


def _best(places: list[Place]) -> Place:
    return max(places, key=lambda place: place.value)


def fits(place: Place) -> bool:
    """Whether the map, changed since, may look like the scan at this place."""
    explained, contradicted = place.agreement
    return explained >= MIN_EXPLAINED and contradicted <= MAX_CONTRADICTED


def compared(
    session: Session,
    episode: Episode,
    given: Pose2 | None = None,
    map_model: MapModel | None = None,
) -> Comparison:
    """Compare the places at which an episode may begin in the session's map, by as much of its
    path as is needed to tell them apart.

    given      a start pose in the map, which may be wrong
    map_model  an empty map, in which the session is drawn; default: `Clamped`
    """
    places = WholeMap(drawn(session, Clamped() if map_model is None else map_model))
    result = None
    for beginning in beginnings(episode):
        before, result = result, _compared(places, beginning, given)
        given = result.given.pose if result.given is not None else None
        if before is not None and same_place(before.best.pose, result.best.pose):
            result = result._replace(again=True)
        if result.unique:
            break
    assert result is not None
    return result


def certain(found: Comparison) -> Place:
    """The best place, if the recording can only begin there.

    Raises InputError if it fits nowhere, or at several places equally well; the message names them.
    """
    if not found.fits:
        explained, contradicted = found.best.agreement
        raise InputError(
            f"the recording does not seem to begin within the map: at the best place, "
            f"{100 * explained:.0f} % of its echoes lie on something there and "
            f"{100 * contradicted:.0f} % in free space, of {100 * MIN_EXPLAINED:.0f} % needed and "
            f"{100 * MAX_CONTRADICTED:.0f} % allowed"
        )
    if not found.unique:
        raise InputError(
            f"the recording may begin at several places of the map, even by the first "
            f"{found.path:.0f} m of its path: give one of them, --start {in_words(found.best.pose)}"
            f" or --start {in_words(found.other.pose)}"
        )
    return found.best


def in_words(pose: Pose2) -> str:
    """A pose as x and y in m and the heading in degrees, separated by spaces."""
    return f"{pose.x:.2f} {pose.y:.2f} {np.degrees(pose.theta):.1f}"


def _compared(places: WholeMap, beginning: Beginning, given: Pose2 | None) -> Comparison:
    scan, middle = beginning.scan, beginning.middle
    start = None if given is None else given @ middle
    near = None if start is None else places.matched(scan, start)
    best, other = places.best_two(scan, start)
    back = middle.inverse()
    return Comparison(
        _shifted(best, back),
        _shifted(other, back),
        None if near is None else _shifted(near, back),
        beginning.length,
    )


def _shifted(place: Place, back: Pose2) -> Place:
    return place._replace(pose=place.pose @ back)


def drawn(session: Session, map_model: MapModel) -> Endpoint:
    """A sensor model on the map of the session, drawn in an empty `map_model`, for matching."""
    for scan, pose in session.keyframes():
        map_model.integrate(scan, pose)
    reading = Endpoint()
    reading.refresh(map_model, np.flatnonzero(map_model.cells.observed.flat))
    return reading
