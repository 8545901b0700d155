"""What was drawn last is judged by what was drawn long before: usual ground, other places, no place
at all."""

import math

import numpy as np
import pytest

from slam.geometry import Array, Pose2, compose
from slam.graph.local_map import LocalMap, panorama
from slam.graph.loops import Loops, Matcher
from slam.graph.searched_map import SearchedMap
from slam.recovery.old_ground import (
    EXPECTED,
    LEARNED,
    LONGEST_PAUSE,
    NOT_HERE,
    RECENT,
    SURELY_NOT_HERE,
    USUAL,
    WINDOW,
    Ground,
    OldGround,
    Other,
    share,
)
from slam.recovery.old_local_maps import LocalGround
from slam.recovery.places import Surroundings
from slam.recovery.watch import MISPLACED
from tests.slam.recovery.drawn_room import reading, room

THERE, ELSEWHERE = Pose2(12.0, 3.0, 1.0), Pose2(-20.0, 5.0, 0.0)
WEAK, STRONG = EXPECTED + 0.4 * NOT_HERE, EXPECTED + 0.6 * NOT_HERE  # nats


def other(pose: Pose2, gain: float) -> Other:
    """A place that fits better than the origin."""
    return Other(Pose2(), pose, gain)


class Told(LocalGround):
    """Ground of which the first coordinate is the share that is unexplained; NaN: new ground."""

    def unexplained(self, scan: object) -> float | None:
        share = float(self.poses[0, 0])
        return None if math.isnan(share) else share


class Scripted(OldGround):
    """Finds what it is told to."""

    def __init__(self, *found: Other | None):
        super().__init__()
        self.found, self.searches = iter(found), 0

    def _elsewhere(self, ground: Ground) -> Other | None:
        self.searches += 1
        return next(self.found)

    def take(self, share: float) -> None:
        poses = np.array([[share, 0.0, 0.0]])
        ground = Told([place(9)], poses, [], Matcher(Loops()), SearchedMap())
        self.judge(ground, panorama(place().keyframes))


def place(ordinal: int = 0) -> LocalMap:
    result = LocalMap((), room(), ordinal)
    for _ in range(4):
        result.add(room(), Pose2())
    return result


def misplaced(*found: Other | None) -> Scripted:
    """Local maps that fit as usual, and then others that do not, for each of the finds."""
    ground = Scripted(*found)
    for told in [USUAL] * WINDOW + [1.0] * len(found):
        ground.take(told)
    return ground


def test_a_map_knows_explains_or_does_not_know_an_echo() -> None:
    inside, walls, beyond = [[0.5, 0.5]], [[2.0, 0.0], [0.0, 1.5]], [[6.0, 0.0], [0.0, -5.0]]
    points, known = np.array(inside + walls + beyond), np.zeros(5, np.uint8)
    reading().raise_known(known, points, Pose2())
    assert known.tolist() == [1, 2, 2, 0, 0]
    reading().raise_known(known, points, Pose2(0.0, 3.5, 0.0))  # the wall behind the last one
    assert known.tolist() == [1, 2, 2, 0, 2]


def test_little_known_ground_judges_only_where_it_is_clearly_wrong() -> None:
    assert share(0.4, 0.1) == pytest.approx(0.2)
    assert share(0.2, 0.1) is None
    assert share(0.0, 0.19) is None
    assert share(0.05, 0.25) == pytest.approx(0.25 / 0.3)
    assert share(0.15, 0.22) is None


def test_one_stretch_that_does_not_fit_at_all_is_searched_for_after_new_ground() -> None:
    ground = Scripted(other(THERE, WEAK))
    for told in [USUAL] * WINDOW + [math.nan] * WINDOW + [USUAL + 0.02]:
        ground.take(told)
    assert ground.searches == 0
    ground.take(0.5)
    assert (ground.searches, ground.votes) == (1, 1)


def test_what_fits_as_usual_is_not_searched_for() -> None:
    ground = Scripted()
    for k in range(50):
        ground.take(USUAL * (k % 3))
    assert (ground.searches, ground.votes) == (0, 0)


def test_two_finds_of_a_place_are_two_votes() -> None:
    assert misplaced(other(THERE, WEAK)).votes == 1
    assert misplaced(other(THERE, WEAK), other(THERE, WEAK)).votes == 2
    assert misplaced(other(THERE, WEAK), other(ELSEWHERE, WEAK)).votes == 1
    assert misplaced(other(THERE, WEAK), None).votes == 0


def test_where_other_places_fit_far_better_together_the_robot_is_not_here() -> None:
    assert misplaced(other(THERE, STRONG), other(ELSEWHERE, STRONG)).votes == MISPLACED
    assert misplaced(other(THERE, WEAK), other(ELSEWHERE, WEAK)).votes == 1
    assert (
        misplaced(other(THERE, WEAK), other(ELSEWHERE, WEAK), other(THERE, WEAK)).votes == MISPLACED
    )
    assert misplaced(other(THERE, EXPECTED + NOT_HERE + 1.0)).votes == MISPLACED
    assert misplaced(*[other(THERE, EXPECTED), other(ELSEWHERE, EXPECTED)] * 5).votes == 1


def test_a_search_in_vain_speaks_for_the_believed_place() -> None:
    found = other(THERE, STRONG), None, other(ELSEWHERE, STRONG)
    assert misplaced(*found[::2]).votes == MISPLACED
    assert misplaced(*found).votes == 1


def test_what_fits_again_ends_the_doubt() -> None:
    ground = misplaced(other(THERE, WEAK))
    ground.found = iter([other(THERE, WEAK)] * WINDOW)
    for _ in range(WINDOW):
        ground.take(0.0)
    assert ground.votes == 0
    ground.take(0.0)
    assert ground.searches == WINDOW
    ground.found = iter([other(ELSEWHERE, STRONG)] * 2)
    while ground.searches == WINDOW:
        ground.take(1.0)
    assert ground.votes == 1


def test_new_ground_ends_the_doubt() -> None:
    ground = misplaced(other(THERE, WEAK))
    for _ in range(WINDOW - 1):
        ground.take(math.nan)
    assert ground.votes == 1
    ground.take(math.nan)
    assert ground.votes == 0


def test_local_maps_from_before_the_robot_was_found_are_not_judged() -> None:
    ground = misplaced(other(THERE, WEAK))
    ground.begin(10)
    for _ in range(2 * WINDOW):
        ground.take(1.0)
    assert (ground.searches, ground.votes) == (1, 0)


def test_a_robot_that_was_found_is_not_doubted_for_what_was_before() -> None:
    ground = misplaced(other(THERE, WEAK))
    ground.begin(9)
    for _ in range(WINDOW - 1):
        ground.take(1.0)
    assert (ground.searches, ground.votes) == (1, 0)


def test_searches_in_vain_become_rare_and_what_stays_unusual_becomes_usual() -> None:
    number = 40
    ground = misplaced(*[None] * number)
    assert ground.searches < number / 2
    searches, rest = ground.searches, 400
    ground.found = iter([None] * rest)
    for _ in range(rest):
        ground.take(USUAL + LEARNED)
    assert ground.searches - searches < rest / LONGEST_PAUSE


def test_local_maps_of_the_last_metres_judge_nothing() -> None:
    places = [place(ordinal) for ordinal in range(RECENT + 3)]
    scan = panorama(places[0].keyframes)
    frames = np.zeros((len(places), 3))

    def judged(number: int) -> float | None:
        middles = [Pose2()] * number
        ground = LocalGround(
            places[:number], frames[:number], middles, Matcher(Loops()), SearchedMap()
        )
        return ground.unexplained(scan)

    assert judged(RECENT + 1) is None
    assert judged(RECENT + 2) == pytest.approx(0.0, abs=0.02)


def test_after_a_dropped_doubt_one_stretch_is_enough_until_old_ground_agrees() -> None:
    ground = Scripted(*[other(THERE, EXPECTED + SURELY_NOT_HERE + 1.0)] * WINDOW)
    ground.begin(9)
    ground.doubt()
    ground.take(1.0)
    assert (ground.open, ground.searches, ground.votes) == (True, 1, MISPLACED)
    for _ in range(WINDOW):
        ground.take(0.0)
    assert (ground.open, ground.votes) == (False, 0)
    searches = ground.searches
    ground.take(1.0)  # the first since the robot was found
    assert ground.searches == searches


def test_after_a_dropped_doubt_what_is_to_be_seen_of_its_reason_is_no_proof() -> None:
    ground = Scripted(other(THERE, EXPECTED + NOT_HERE + 1.0))
    ground.doubt()
    ground.take(1.0)
    assert (ground.searches, ground.votes) == (1, 1)


def test_a_robot_arrives_from_new_ground_until_old_ground_agrees_or_it_is_found() -> None:
    def arrived() -> Scripted:
        ground = Scripted(*[None] * WINDOW)
        for _ in range(WINDOW - 1):
            ground.take(math.nan)
        assert not ground.arriving
        ground.take(math.nan)
        return ground

    ground = arrived()
    ground.take(1.0)
    assert ground.arriving
    for _ in range(WINDOW):
        ground.take(0.0)
    assert not ground.arriving
    ground = arrived()
    ground.begin(9)
    assert not ground.arriving
    for _ in range(WINDOW):
        ground.take(math.nan)
    assert ground.arriving


def test_votes_are_for_a_way_from_the_believed_place() -> None:
    before, here = Pose2(-1.0, 3.0, 0.7), Pose2(2.0, -1.0, 0.1)
    first = Other(before, THERE @ before, WEAK)
    assert misplaced(first, Other(here, THERE @ here, WEAK)).votes == 2
    assert misplaced(first, Other(here, THERE @ before, WEAK)).votes == 1


def test_old_local_maps_that_moved_together_are_searched_where_they_were_drawn() -> None:
    places = [place(ordinal) for ordinal in range(RECENT + 3)]
    moved, drawn, last = Pose2(5.0, 1.0, 0.5), SearchedMap(), Pose2(0.3, 0.2, 0.1)
    frames = np.array([last] * len(places))

    def old(poses: Array) -> Surroundings:
        return LocalGround(places, poses, [], Matcher(Loops()), drawn).old()

    field, frame = old(frames)
    assert frame == pytest.approx(last)
    tiles, explained = field.tiles, field.shares(room().points, frame)[0]
    assert explained > 0.9
    field, frame = old(compose(moved, frames))
    assert field.tiles is tiles
    assert frame == pytest.approx(last)
    assert field.shares(room().points, frame)[0] == pytest.approx(explained)
