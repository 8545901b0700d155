"""Which of the places that a search finds counts."""

import math

import pytest

from slam.geometry import Pose2
from slam.recovery import rivals
from slam.recovery.agreement import Agreement
from slam.recovery.lost_belief import LostBelief
from slam.recovery.places import Place
from slam.recovery.rivals import AFTER_JUMP, AFTER_TURN, Beginning, Check, Proof, Rivals
from tests.slam.recovery.drawn_room import reading, room

HERE, BEST, SECOND = (Place(Pose2(x), -x, Agreement(0.9, 0.0)) for x in (40.0, 10.0, 20.0))


class Searched:
    """A search that finds two places, of which the first scan of the doubt fits the second one."""

    def __init__(self, *_: object, **__: object):
        pass

    def better_than(self, *_: object) -> list[Place]:
        return [BEST, SECOND]


def began(_: Check, place: Place) -> Beginning:
    return Beginning(1.0 if place is SECOND else -1.0, 0.0, 0.9)


@pytest.mark.parametrize(("proof", "found"), [(AFTER_JUMP, SECOND), (AFTER_TURN, None)])
def test_the_beginning_chooses_but_where_the_map_alone_tells_the_best_place_counts_alone(
    monkeypatch: pytest.MonkeyPatch, proof: Proof, found: Place | None
) -> None:
    monkeypatch.setattr(rivals, "Places", Searched)
    monkeypatch.setattr(Check, "speaks_for", lambda *_: True)
    monkeypatch.setattr(Check, "began", began)
    check = Check(reading(), room(), HERE, LostBelief(), proof, None, math.inf)
    assert Rivals()._found(check) == found
