"""What a lost robot asks of a place."""

from __future__ import annotations

import math
from typing import NamedTuple

NEW_GROUND = 10.0  # m, driven in vain, before it goes on where the ground may be new


class Demands(NamedTuple):
    """What is asked of a place before a lost robot is believed to be there.

    path           m, driven since it got lost
    contradicted   share of the echoes, at most
    sudden         whether a sign preceded that the robot was carried: it is at the believed place
                   only if the map agrees, or is new ground
    torn           whether that scan changed by more than doors make: the robot was carried
    usual          share of the echoes that the map explains in this recording
    continuous     whether its errors may have added up: each scan followed from the one before, and
                   the share that the map explains did not only fall at once
    within         m and rad from the believed place; None: anywhere. After a gap in the scans the
                   odometry did not fail: the robot may see new ground that looks like another place
    likely         m from the believed place; a place farther away must be found `astray.LONGER`
                   times, as where a loop closes another place that looks alike may be known better
    no_new_ground  whether the believed place is none: known ground did not agree with the robot,
                   or the map is not drawn any more
    new_ground     m, driven in vain before it goes on where the map does not know the ground
    """

    path: float
    contradicted: float
    sudden: bool
    torn: bool = False
    usual: float = 0.9
    continuous: bool = False
    within: tuple[float, float] | None = None
    likely: float = math.inf
    no_new_ground: bool = False
    new_ground: float = NEW_GROUND


SUDDEN = Demands(0.7, 0.2, True, new_ground=30.0)
GRADUAL = Demands(1.0, 0.1, False)
