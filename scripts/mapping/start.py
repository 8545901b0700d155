"""Where a recording begins in the map of --onto: found, or given by --start and compared."""

from __future__ import annotations

import math
import sys
from typing import NamedTuple

from slam.bounds import MAX_COORDINATE, all_within
from slam.episode import Episode
from slam.errors import InputError
from slam.geometry import Pose2
from slam.interface import LOST_DISTANCE, LOST_TURN
from slam.recovery.places import Place
from slam.sessions.relocalisation import Comparison, certain, compared, in_words
from slam.sessions.session import Session


class Start(NamedTuple):
    """The start pose in the map, and what is to be told of the one that was given."""

    pose: Pose2
    warnings: tuple[str, ...] = ()


def parsed_pose(option: str, numbers: tuple[float, float, float] | None) -> Pose2 | None:
    """The pose that an option gives, x and y in m and degrees. Raises InputError."""
    if numbers is None:
        return None
    if not all_within(numbers, MAX_COORDINATE):
        raise InputError(
            f"{option} is three finite numbers up to {MAX_COORDINATE:g}, got {numbers}"
        )
    x, y, degrees = numbers
    return Pose2(x, y, math.radians(degrees))


def start_in(session: Session, episode: Episode, given: Pose2 | None) -> Start:
    """The start pose of the episode in the session's map; told on standard error. Raises InputError
    if none was given, and it begins nowhere in the map, or at several places equally well."""
    if given is None:
        print("looking for the start pose in the map ...", file=sys.stderr)
        found = compared(session, episode)
        pose = certain(found).pose
        print(
            f"found: --start {in_words(pose)}, which fits better than any other place by "
            f"{found.gain:.0f} nats",
            file=sys.stderr,
        )
        return Start(pose)
    start = judged(given, compared(session, episode, given))
    for warning in start.warnings:
        print(f"warning: {warning}", file=sys.stderr)
    return start


def judged(given: Pose2, found: Comparison) -> Start:
    """The start pose, given one of them and how it compares with the others of the map."""
    assert found.given is not None
    if (found.given_is_best and found.fits) or found.given_is_possible:
        near = found.given.pose
        return Start(near, () if _same(given, near) else (_off(given, near),))
    if found.unique:
        return Start(found.best.pose, (_mended(given, found),))
    return Start(given, (_kept(given, found),))


def _same(given: Pose2, found: Pose2) -> bool:
    apart = given.between(found)
    return math.hypot(apart.x, apart.y) <= LOST_DISTANCE and abs(apart.theta) <= LOST_TURN


def _off(given: Pose2, near: Pose2) -> str:
    apart = given.between(near)
    return (
        f"--start {in_words(given)} is off by {math.hypot(apart.x, apart.y):.2f} m and "
        f"{abs(math.degrees(apart.theta)):.0f} degrees; used instead: --start {in_words(near)}"
    )


def _mended(given: Pose2, found: Comparison) -> str:
    return (
        f"{_agreement(given, found)}; used instead: --start {in_words(found.best.pose)}, where "
        f"{_explained(found.best)} of them do, and which fits better than any other place by "
        f"{found.gain:.0f} nats"
    )


def _kept(given: Pose2, found: Comparison) -> str:
    if found.given_is_best:
        return f"{_agreement(given, found)}, and no other place fits better; used as given"
    return (
        f"{_agreement(given, found)}, but no other place of the map is certain; used as given. It "
        f"may be --start {in_words(found.best.pose)}, where {_explained(found.best)} of them do"
    )


def _agreement(given: Pose2, found: Comparison) -> str:
    assert found.given is not None
    return (
        f"--start {in_words(given)} seems to be wrong: {_explained(found.given)} of the echoes of "
        f"the first {found.path:.0f} m of path lie on something in the map"
    )


def _explained(place: Place) -> str:
    return f"{100 * place.agreement.explained:.0f} %"
