"""Doors of a building from visit to visit: found again, and their habits learned."""

from __future__ import annotations

import copy
import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from slam.forecast.door import DoorForecast
from slam.geometry import Array, Pose2, transform_points
from slam.io.door_memory import RememberedDoor
from slam.layers import Layers
from slam.layers.door_sights import Sight, echoes, history
from slam.layers.doors import MappedDoor
from slam.sessions.session import Session, is_dated

SAME_DISTANCE = 0.4  # m between the middles of a door that is found again,
SAME_TURN = math.radians(30.0)  # rad, and of their lines
FORGOTTEN = 90 * 86400.0  # s after the last look, when a door that is not found is forgotten


def remembered(session: Session, found: Sequence[MappedDoor]) -> tuple[RememberedDoor, ...]:
    """The doors of the session, given those that are found in it now: known ones, as they are found
    now, and new ones that are sure and moved. Their habits are learned from the
    recordings since then."""
    known, left = [], [door for door in found if door.sure and door.moved]
    for one in session.doors:
        again = _same(one.door, found)
        left = [door for door in left if door is not again]
        if again is not None or not _forgotten(one):
            known.append(one if again is None else one._replace(door=again))
    new = [RememberedDoor(door, DoorForecast(), -math.inf) for door in left]
    return _learned(session, [*known, *new])


def with_remembered(
    made: Layers, doors: Sequence[RememberedDoor]
) -> tuple[Layers, list[dict[str, Any] | None]]:
    """The layers with the doors that are remembered and those found that are not, the most probable
    first; and the week of each, None where it is not remembered, or no time was unix time."""
    known = [one.door for one in doors]
    weeks = [None if one.forecast.look is None else one.forecast.to_dict() for one in doors]
    others = [door for door in made.doors if not any(door is one for one in known)]
    pairs = [*zip(known, weeks, strict=True), *((door, None) for door in others)]
    pairs.sort(key=lambda pair: -pair[0].probability)
    return replace(made, doors=tuple(door for door, _ in pairs)), [week for _, week in pairs]


def moved_doors(
    doors: Sequence[RememberedDoor], before: Array, after: Array
) -> tuple[RememberedDoor, ...]:
    """Doors of a session whose poses (n, 3) were moved: each with the scan nearest to it."""
    return tuple(one._replace(door=_moved(one.door, before, after)) for one in doors)


def joined(
    doors: Sequence[RememberedDoor], others: Sequence[RememberedDoor], apart: bool
) -> tuple[RememberedDoor, ...]:
    """The doors of two sessions of one place. Of a door that both remember, the habits are added,
    and it lies where it was mapped last.

    apart  whether no recording is in both sessions; if one is, the habits are those that were
           learned until later, since no look may count twice
    """
    result, left = [], list(others)
    for one in doors:
        again = _same(one.door, [other.door for other in left])
        same = [other for other in left if other.door is again]
        left = [other for other in left if other.door is not again]
        last = max([one, *same], key=lambda door: door.until)
        if same and apart:
            last = last._replace(forecast=one.forecast.joined(same[0].forecast))
        result.append(last)
    return (*result, *left)


def _moved(door: MappedDoor, before: Array, after: Array) -> MappedDoor:
    nearest = int(np.argmin(np.hypot(*(before[:, :2] - door.ends.mean(axis=0)).T)))
    move = Pose2.of(after[nearest]) @ Pose2.of(before[nearest]).inverse()
    return door._replace(ends=transform_points(move, door.ends))


def _same(door: MappedDoor, found: Iterable[MappedDoor]) -> MappedDoor | None:
    """The nearest of the doors found that may be this one."""
    near = [other for other in found if _distance(door, other) < SAME_DISTANCE]
    near = [other for other in near if _turn(door, other) < SAME_TURN]
    return min(near, key=lambda other: _distance(door, other), default=None)


def _distance(one: MappedDoor, other: MappedDoor) -> float:
    return float(np.hypot(*(one.ends.mean(axis=0) - other.ends.mean(axis=0))))


def _turn(one: MappedDoor, other: MappedDoor) -> float:
    """rad between the lines of two doors, at most a right angle."""
    a, b = ((door.ends[1] - door.ends[0]) / door.width for door in (one, other))
    return math.acos(min(abs(float(a @ b)), 1.0))


def _forgotten(one: RememberedDoor) -> bool:
    look = one.forecast.look
    return look is not None and one.until - look.time > FORGOTTEN


def _learned(session: Session, doors: list[RememberedDoor]) -> tuple[RememberedDoor, ...]:
    """The doors with what the recordings after `until` show of them; the old ones do not change."""
    forecasts, times = [copy.deepcopy(one.forecast) for one in doors], session.times
    until = np.array([one.until for one in doors])
    for recording in np.unique(session.recordings).tolist():
        which = np.flatnonzero(session.recordings == recording)
        begin, end = times[which[[0, -1]]].tolist()
        if not is_dated(begin) or not (until < begin).any():
            continue
        seen = echoes([session.scans[k] for k in which.tolist()], session.poses[which])
        for k in np.flatnonzero(until < begin).tolist():
            _learn(forecasts[k], history(doors[k].door, seen), begin)
        until = np.maximum(until, end)
    learned = zip(doors, forecasts, until.tolist(), strict=True)
    return tuple(RememberedDoor(one.door, forecast, end) for one, forecast, end in learned)


def _learn(forecast: DoorForecast, sights: Iterable[Sight], begin: float) -> None:
    for sight in sights:
        if sight.end > sight.begin:
            forecast.update(begin + sight.begin, begin + sight.end, int(sight.open))
        else:
            forecast.observe(begin + sight.begin, int(sight.open))
