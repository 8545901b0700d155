"""The old ground of a graph: its local maps, without the last ones."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from slam.geometry import Array, Pose2, compose
from slam.graph.local_map import Keyframe, LocalMap, Panorama, panorama
from slam.graph.loops import Matcher
from slam.graph.searched_map import SearchedMap
from slam.recovery.old_ground import KEYFRAMES, RECENT, WINDOW, share
from slam.recovery.places import Surroundings
from slam.sensor_models.endpoint import Endpoint

NEAREST, FARTHEST = 4, 8.0  # old local maps, at most, that judge; m, between centres


class LocalGround(NamedTuple):
    """Local maps, as the `Ground` that the last of them is judged by.

    places   in the order of time
    poses    (n, 3) of their frames
    middles  their centres, each in its frame
    matcher  reads them
    drawn    the map of the old ones
    """

    places: Sequence[LocalMap]
    poses: Array
    middles: Sequence[Pose2]
    matcher: Matcher
    drawn: SearchedMap

    @property
    def ordinal(self) -> int:
        """That of the last local map."""
        return self.places[-1].ordinal

    @property
    def frame(self) -> Pose2:
        """The frame of the last local map."""
        return Pose2.of(self.poses[-1])

    def unexplained(self, scan: Panorama) -> float | None:
        """The share that the nearest old local maps know and do not explain."""
        centres = compose(self.poses, np.array(self.middles))
        apart = np.hypot(*(centres[: _old(self.places), :2] - centres[-1, :2]).T)
        chosen = [int(k) for k in np.argsort(apart, kind="stable")[:NEAREST] if apart[k] < FARTHEST]
        judges = [(self.places[k], Pose2.of(self.poses[k]).between(self.frame)) for k in chosen]
        return share(*self.matcher.known_shares(judges, scan))

    def last(self, begin: int) -> Panorama:
        """The last keyframes as one scan."""
        found = []
        for place, pose in zip(self.places[-WINDOW:], self.poses[-WINDOW:], strict=True):
            if place.ordinal >= max(begin, self.ordinal - WINDOW + 1):
                away = self.frame.between(Pose2.of(pose))
                found += [Keyframe(one.scan.bare(), away @ one.pose) for one in place.keyframes]
        return panorama(found[-KEYFRAMES:])

    def old(self) -> Surroundings:
        """The map of the old local maps, which may lie elsewhere together, and the last frame."""
        self.matcher.pack()  # makes room for it
        number = _old(self.places)
        return Surroundings(
            *self.drawn.around(self.places[:number], self.poses[:number], self.frame)
        )


def old_endpoint(whole: SearchedMap, places: Sequence[LocalMap], poses: Array) -> Endpoint:
    """The field of the local maps at `poses` (n, 3) that were drawn long before the last one, in a
    map kept for them; valid until the next call."""
    old = _old(places)
    return whole.endpoint(places[:old], poses[:old])


def _old(places: Sequence[LocalMap]) -> int:
    """The number of local maps that were drawn long before the last one."""
    return sum(place.ordinal < places[-1].ordinal - RECENT for place in places)
