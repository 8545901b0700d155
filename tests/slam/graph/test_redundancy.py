import math

import numpy as np
import pytest

from slam.geometry import Pose2, compose
from slam.graph.local_map import LocalMap
from slam.graph.redundancy import Redundancy
from slam.scan import Scan

SCAN = Scan(np.ones(1), np.zeros(1), 5.0)


def visit(ordinal: int, length=4.0, step=0.1) -> LocalMap:
    """A local map of a straight path."""
    place = LocalMap((), SCAN, ordinal)
    for x in np.arange(step, length + step / 2, step):
        place.add(SCAN, Pose2(float(x)))
    return place


class Visits:
    """Local maps, each of which begins at a pose in the world."""

    def __init__(self) -> None:
        self.places: list[LocalMap] = []
        self.poses = np.zeros((0, 3))

    def add(self, pose: Pose2, ordinal: int) -> None:
        self.places.append(visit(ordinal))
        self.poses = np.vstack([self.poses, pose])

    def choice(self, visits: int):
        middles = compose(self.poses, np.array([place.middle() for place in self.places]))
        return Redundancy(visits).choice(
            self.places, middles[:, :2], self.poses, len(self.places) - 1
        )

    def forget(self, visits: int) -> None:
        while chosen := self.choice(visits):
            del self.places[chosen[0]]
            self.poses = np.delete(self.poses, chosen[0], axis=0)


def lap(count: int, off=Pose2(0.3, 0.2, 0.1)) -> Visits:
    """The same 4 m, so many times, a little elsewhere each time."""
    result, rng = Visits(), np.random.default_rng(0)
    for k in range(count):
        result.add(Pose2.of(rng.uniform(-1, 1, 3) * off), k)
    return result


@pytest.mark.parametrize("visits", [1, 2, 5])
def test_one_is_forgotten_when_enough_others_cover_it(visits: int) -> None:
    assert lap(visits + 1).choice(visits + 1) is None
    if visits > 1:
        assert lap(visits).choice(visits) is None
    chosen = lap(visits + 2).choice(visits)
    assert chosen is not None
    number, others = chosen
    assert 0 < number < visits + 1
    assert set(others.tolist()) == set(range(visits + 2)) - {number}


@pytest.mark.parametrize(
    "apart", [Pose2(0.0, 2.5), Pose2(4.0, 0.0, math.pi), Pose2(3.0), Pose2(0.0, 0.0, 1.2)]
)
def test_what_was_seen_from_elsewhere_is_not_redundant(apart: Pose2) -> None:
    """Beside, in the other direction, further on, and at an angle."""
    places = Visits()
    for k in range(6):
        places.add(Pose2() if k in (0, 3, 5) else apart, k)
    assert places.choice(3) is None
    assert places.choice(2) is not None


def test_the_first_and_the_last_are_kept_and_others_from_all_times() -> None:
    places, most, kept = Visits(), 0, []
    rng = np.random.default_rng(1)
    for k in range(200):
        places.add(Pose2.of(rng.uniform(-1, 1, 3) * Pose2(0.3, 0.2, 0.1)), k)
        places.forget(5)
        most = max(most, len(places.places))
        kept = [place.ordinal for place in places.places]
        assert kept[0] == 0
        assert kept[-1] == k
    assert most == 6
    gaps = np.diff(kept)
    assert gaps.max() <= 200 / 2
    assert sorted(gaps)[-2] <= 200 / 3


def test_a_long_way_keeps_as_many_of_each_of_its_parts() -> None:
    """Five parts, one after the other, in many laps that begin anywhere."""
    places, rng = Visits(), np.random.default_rng(2)
    for k in range(150):
        places.add(Pose2(4.0 * (k % 5) + rng.uniform(0, 2), rng.uniform(-0.3, 0.3)), k)
        places.forget(3)
    where = places.poses[:, 0] // 4.0
    assert len(places.places) <= 5 * 6
    assert set(where.tolist()) >= {0.0, 1.0, 2.0, 3.0, 4.0}
    assert {place.ordinal for place in places.places} >= {148, 149}


def test_a_far_place_does_not_count() -> None:
    places = lap(4)
    for k in range(4):
        places.add(Pose2(100.0 * (k + 1)), 10 + k)
    assert places.choice(1) is None  # the last one is of a place of its own
