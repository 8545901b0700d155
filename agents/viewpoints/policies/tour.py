"""Tour: visit a fixed round of viewpoints that together show all doors."""

from __future__ import annotations

import numpy as np

from agents.viewpoints.policies.stand import unsettled
from agents.viewpoints.situation import Situation
from slam.geometry import Array

SETTLED = 0.06  # expected squared error, long after a look, of a doorway that does not change


class Tour:
    """A greedy cover of the doors, in the order of a short round (nearest neighbour, 2-opt).

    Doorways that are known to stay as they are, bare ones, are left out.
    """

    def choose(self, situation: Situation) -> int:
        """See `ViewpointPolicy`."""
        round_ = _shortened(_cover(situation), situation.between)
        here = situation.times if situation.last < 0 else situation.between[situation.last]
        near = int(np.argmin(here[round_]))
        following = round_[near if round_[near] != situation.last else (near + 1) % len(round_)]
        return following if np.isfinite(situation.times[following]) else _nearest(situation)


def _nearest(situation: Situation) -> int:
    return int(np.argmin(situation.times))


def _cover(situation: Situation) -> list[int]:
    """Viewpoints that show all doors which any shows, the most new ones first."""
    shown = situation.around & np.isfinite(situation.times)[:, None]
    left, chosen = shown.any(axis=0) & (unsettled(situation) > SETTLED), []
    while left.any():
        chosen.append(int((shown & left).sum(axis=1).argmax()))
        left &= ~shown[chosen[-1]]
    return chosen or [_nearest(situation)]


def _shortened(places: list[int], between: Array) -> list[int]:
    """The places in the order of a short round."""
    order, left = [places[0]], places[1:]
    while left:
        order.append(min(left, key=lambda k: between[order[-1], k]))
        left.remove(order[-1])
    improved = True
    while improved:
        improved = False
        for i in range(1, len(order) - 1):
            for j in range(i + 1, len(order)):
                other = order[:i] + order[i : j + 1][::-1] + order[j + 1 :]
                if _length(other, between) < _length(order, between) - 1e-9:
                    order, improved = other, True
    return order


def _length(order: list[int], between: Array) -> float:
    return float(between[order, order[1:] + order[:1]].sum())
