"""Where the frame of a session lies in the map of another one, told by all its stretches."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from slam.errors import InputError
from slam.geometry import Pose2
from slam.recovery.places import MANY, Place, Places, matched, same_place
from slam.sensor_models.endpoint import Endpoint
from slam.sessions.relocalisation import in_words
from slam.sessions.stretches import LENGTH, Stretch

SHOWN, CONTRADICTED = 0.45, 0.2  # share of the echoes of a stretch that the map explains at least
# where it shows the stretch, and contradicts at most: doors move
LEAST_SHOWN = 3  # stretches that the map shows at least,
RIVAL = 2  # and so many more for each that it shows at another place


class Proposal(NamedTuple):
    """A place of the other session's frame.

    shown  stretches that the first map shows there, less those that it contradicts
    value  log-likelihood of all stretches
    """

    shown: int
    value: float
    place: Pose2


def placed(reading: Endpoint, parts: Sequence[Stretch]) -> tuple[Proposal, Proposal | None]:
    """Where the other session's frame lies: the proposal that most stretches agree with, and the
    best one of another place, if any. Raises InputError if there is none."""
    places = Places(reading, echoes=MANY)
    proposals: list[Proposal] = []
    for part in parts:
        for found in places.all(part.scan, SHOWN):
            place = found.pose @ part.pose.inverse()
            new = not any(_same(place, one.place, [part]) for one in proposals)
            if new and told(reading, part, found) == 1:
                proposals.append(proposal(reading, parts, place))
    if not proposals:
        raise InputError(not_enough(len(parts), 0, LEAST_SHOWN))
    best = max(proposals)
    others = [one for one in proposals if not _same(best.place, one.place, parts)]
    return best, max(others, default=None)


def check_certain(best: Proposal, rival: Proposal | None, tied: int, searched: int) -> None:
    """Raise InputError if the other session's frame may lie elsewhere, too.

    tied      stretches that were matched with the map at the best place
    searched  stretches that were compared
    """
    shown = min(best.shown, tied)
    if rival is not None and LEAST_SHOWN <= shown < LEAST_SHOWN + RIVAL * rival.shown:
        raise InputError(
            f"the maps may overlap at several places: give where the other one's origin lies in "
            f"the first, --at {in_words(best.place)} ({shown} of {searched} stretches agree with "
            f"it) or --at {in_words(rival.place)} ({rival.shown})"
        )
    if shown < LEAST_SHOWN:
        raise InputError(not_enough(searched, shown, LEAST_SHOWN))


def proposal(reading: Endpoint, parts: Sequence[Stretch], place: Pose2) -> Proposal:
    """How stretches agree with a place of the other session's frame; each is matched near by, since
    that map may be bent."""
    found = [matched(reading, part.scan, place @ part.pose) for part in parts]
    shown = [told(reading, part, one) for part, one in zip(parts, found, strict=True)]
    return Proposal(sum(shown), sum(one.value for one in found), place)


def _same(one: Pose2, other: Pose2, parts: Sequence[Stretch]) -> bool:
    """Whether two places of the other frame have any of the stretches at the same place; those of a
    bent map do not have all of them there."""
    return any(same_place(one @ part.pose, other @ part.pose) for part in parts)


def told(reading: Endpoint, part: Stretch, place: Place) -> int:
    """1 if the map shows a stretch at a place, -1 if it contradicts it, 0 if it tells nothing.

    Echoes behind walls count as contradicted: the two sides of a wall look alike.
    """
    behind = reading.behind(part.scan.points, part.scan.views, place.pose)
    explained, contradicted = place.agreement
    if contradicted + behind > CONTRADICTED:
        return -1
    return int(explained - behind >= SHOWN)


def not_enough(searched: int, shown: int, needed: int) -> str:
    """Why maps cannot be merged: so many of the stretches searched for are shown."""
    return (
        f"the maps do not overlap enough: of {searched} stretches of the other one, {LENGTH:g} m "
        f"of path each, {max(shown, 0) or 'none'} lie on what the first map shows, of {needed} "
        f"needed"
    )
