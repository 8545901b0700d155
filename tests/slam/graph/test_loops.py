import math
from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from agents import record_path
from slam import make
from slam.benchmark.run import run, true_start
from slam.errors import InputError
from slam.geometry import Pose2
from slam.graph import loops
from slam.graph.local_map import LocalMap
from slam.graph.loops import Loops, Match, Matcher, cautious
from slam.scan import Scan
from tests.slam.worlds import FAN, ROOM, loop, scan_at

OTHER = np.array(
    [[*a, *b] for a, b in pairwise([(-1.5, -1.0), (0.5, -1.9), (1.0, -0.9), (2.6, -0.9), (1.9, 0.9),
                                    (2.2, 2.4), (0.1, 1.5), (-0.9, 2.3), (-1.5, -1.0)])]
)  # fmt: skip
CORRIDOR = np.array([(-40.0, -1.0, 40.0, -1.0), (-40.0, 1.0, 40.0, 1.0)])
POSES = [Pose2.of(pose) for pose in loop(40)]


def mapped(poses, walls=ROOM, seed=0) -> LocalMap:
    rng = np.random.default_rng(seed)
    place = LocalMap((), scan_at(poses[0], walls=walls, rng=rng))
    for pose in poses[1:]:
        place.add(scan_at(pose, walls=walls, rng=rng), poses[0].between(pose))
    return place


@cache
def room() -> LocalMap:
    return mapped(POSES[:25])


HERE = POSES[18:38]
TRUTH = POSES[0].between(HERE[0])  # of their first, in the frame of the room


def about(deviations) -> np.ndarray:
    return np.diag(np.square(deviations))


@pytest.mark.parametrize(
    "off",
    [
        Pose2(),
        Pose2(0.1, -0.05, 0.02),
        Pose2(1.9, 0.5, math.radians(20.0)),
        Pose2(-1.3, 1.5, math.radians(-20.0)),
        Pose2(0.4, -1.9, math.radians(15.0)),
    ],
)
def test_a_displacement_is_found_from_two_metres_off(off: Pose2) -> None:
    panorama = mapped(HERE, seed=1).panorama()
    covariance = about((0.7, 0.7, math.radians(8.0)))
    match = Matcher(Loops()).match(room(), panorama, TRUTH @ off, covariance)
    error = TRUTH.between(match.pose)
    assert math.hypot(error.x, error.y) < 0.01
    assert abs(error.theta) < math.radians(0.2)
    assert Loops().accepts(match)
    assert match.explained > 0.9


def test_what_is_sure_is_looked_for_nearby_alone() -> None:
    panorama = mapped(HERE, seed=1).panorama()
    off = TRUTH @ Pose2(1.5, 0.0, 0.0)
    match = Matcher(Loops()).match(room(), panorama, off, about((0.01, 0.01, 0.001)))
    assert math.hypot(match.pose.x - off.x, match.pose.y - off.y) < 1.0
    assert not Loops().accepts(match)


@pytest.mark.parametrize("deviations", [(0.05, 0.05, 0.02), (1.0, 1.0, 0.2)])
@pytest.mark.parametrize("walls", [OTHER, CORRIDOR])
def test_another_room_is_not_believed(walls, deviations) -> None:
    panorama = mapped(HERE, walls=walls).panorama()
    match = Matcher(Loops()).match(room(), panorama, TRUTH, about(deviations))
    assert not Loops().accepts(match)


@pytest.mark.parametrize(
    ("explained", "contradicted", "innovation", "off", "believed"),
    [
        (0.45, 0.2, 9.0, 5.0, True),
        (0.44, 0.2, 0.0, 0.0, False),
        (0.55, 0.21, 0.0, 0.0, False),
        (0.9, 0.0, 9.1, 1.1, False),
        (0.9, 0.0, 9.1, 1.0, True),
    ],
)
def test_the_limits_of_belief(
    explained: float, contradicted: float, innovation: float, off: float, believed: bool
) -> None:
    match = Match(Pose2(), np.eye(3), explained, contradicted, 0.0, innovation, off)
    assert Loops().accepts(match) == believed


def test_the_same_room_far_from_where_it_was_expected_is_another_one() -> None:
    panorama = mapped(HERE, seed=1).panorama()
    predicted = Pose2(TRUTH.x + 1.3, TRUTH.y + 1.3, TRUTH.theta)
    likely, unlikely = (
        Matcher(Loops()).match(room(), panorama, predicted, about((std, std, 0.05)))
        for std in (0.5, 0.2)
    )
    for match in (likely, unlikely):
        assert math.dist(match.pose[:2], TRUTH[:2]) < 0.01
    assert likely.innovation == pytest.approx(1.3 * math.sqrt(2.0) / 0.5, rel=0.02)
    assert Loops().accepts(likely)
    assert unlikely.innovation > 9.0
    assert unlikely.off == pytest.approx(1.3 * math.sqrt(2.0), abs=0.02)
    assert not Loops().accepts(unlikely)


def test_the_two_sides_of_a_wall_are_not_taken_for_one() -> None:
    """A hall with piers, and in it a wall 0.3 m thick: its left side was mapped, its right one is
    seen."""
    wall = np.array([(-0.15, -1.5, -0.15, 0.6), (-0.15, 0.6, 0.15, 0.6), (0.15, 0.6, 0.15, -1.5)])
    piers = np.array([(x, 1.5, x, 1.2) for x in (0.9, 1.6, 2.3, 3.0)])
    hall = np.vstack([(-9.0, -1.5, 9.0, -1.5), (-9.0, 1.5, 9.0, 1.5), wall, piers])
    left = [Pose2(-2.0 + 0.1 * k, 0.9, 0.0) for k in range(15)]
    right = [Pose2(2.0 - 0.1 * k, -0.5, math.pi) for k in range(12)]
    panorama = mapped(right, hall, seed=1).panorama()
    truth, covariance = left[0].between(right[0]), about((0.1, 0.1, 0.01))
    match = Matcher(Loops()).match(mapped(left, hall), panorama, truth, covariance)
    assert math.dist(match.pose[:2], truth[:2]) < 0.05
    assert match.behind == 0.0


def of_a_corridor(step: float, turn: float) -> tuple[float, float, np.ndarray]:
    """Information along and across it, and the whole matrix, in a rotated frame."""
    angles, rng = np.radians(np.arange(-120, 121, step)), np.random.default_rng(0)
    places = []
    for begin in (Pose2(0.0, 0.0, turn), Pose2(0.37, 0.0, turn + 1.2)):
        place = None
        for k in range(20):
            pose = Pose2(begin.x + 0.1 * k, 0.0, begin.theta)
            scan = scan_at(pose, 0.0, angles, CORRIDOR, rng=rng)
            place = place or LocalMap((), scan)
            if k:
                place.add(scan, begin.between(pose))
        places.append(place)
    predicted = Pose2(0.0, 0.0, turn).between(Pose2(0.37, 0.02, turn + 1.21))
    panorama = places[1].panorama()
    match = Matcher(Loops()).match(places[0], panorama, predicted, about((0.1, 0.1, 0.02)))
    heading = turn + match.pose.theta
    assert heading == pytest.approx(turn + 1.2, abs=0.01)
    along = np.array([math.cos(heading), -math.sin(heading), 0.0])
    across = np.array([math.sin(heading), math.cos(heading), 0.0])
    information = match.information
    known = [float(axis @ information @ axis) for axis in (along, across)]
    return known[0], known[1], information


@pytest.mark.parametrize("turn", [0.0, 0.7, -2.0])
@pytest.mark.parametrize("step", [0.5, 2.0])
def test_of_a_corridor_a_match_knows_most_across_it(step: float, turn: float) -> None:
    along, across, information = of_a_corridor(step, turn)
    np.testing.assert_array_equal(information, information.T)
    assert np.linalg.eigvalsh(information).min() > -1e-6
    assert across > 1500
    assert along < across


@pytest.mark.parametrize("turn", [0.0, 0.3, 0.7, math.pi / 4, -2.0])
@pytest.mark.parametrize("step", [0.5, 2.0])
def test_of_a_corridor_a_match_knows_little_along_it(step: float, turn: float) -> None:
    along, across, _ = of_a_corridor(step, turn)
    assert along < 0.1 * across


def test_no_match_is_surer_than_the_floor() -> None:
    floor = (0.05, 0.1, 0.02)
    panorama = mapped(HERE, seed=1).panorama()
    matches = [
        Matcher(Loops(floor=one)).match(room(), panorama, TRUTH, about((0.05, 0.05, 0.01)))
        for one in ((1e-6, 1e-6, 1e-6), floor)
    ]
    sure, wide = (np.linalg.inv(match.information) for match in matches)
    np.testing.assert_allclose(wide - sure, about(floor), rtol=1e-3, atol=1e-7)
    assert (np.diag(sure) < np.square(floor)).all()


@pytest.mark.parametrize(
    ("frame", "tolerance"),
    [
        (Pose2(3.2, -6.4, math.pi / 2), 0.002),  # the cells are the same
        (Pose2(0.35, -1.2, math.pi), 0.002),
        (POSES[0].between(POSES[12]), 0.25),
    ],
)
def test_its_information_is_in_its_own_frame(frame: Pose2, tolerance: float) -> None:
    """The same place in another frame has the same information."""
    assert abs(frame.theta) > 1.0
    loops, wide = Loops(floor=(1e-4, 1e-4, 1e-5)), about((0.05, 0.05, 0.01))
    panorama = mapped(HERE, seed=1).panorama()
    first = Matcher(loops).match(room(), panorama, TRUTH, wide)
    turned = LocalMap((), room().keyframes[0].scan)
    turned.keyframes = [k._replace(pose=frame @ k.pose) for k in room().keyframes]
    second = Matcher(loops).match(turned, panorama, frame @ TRUTH, wide)
    scale = np.sqrt(np.diag(first.information))
    np.testing.assert_allclose(
        second.information / np.outer(scale, scale),
        first.information / np.outer(scale, scale),
        atol=tolerance,
    )


@pytest.mark.parametrize("fill", [math.nan, math.inf])
def test_where_nothing_was_seen_nothing_is_believed(fill: float) -> None:
    blind = LocalMap((), Scan(np.full(len(FAN), fill), FAN, 6.0))
    for place, scan in (
        (blind, blind.panorama()),
        (room(), blind.panorama()),
        (blind, room().panorama()),
    ):
        match = Matcher(Loops()).match(place, scan, Pose2(0.3), about((0.1, 0.1, 0.1)))
        assert not Loops().accepts(match)
        assert np.isfinite([*match.pose, *match.information.ravel()]).all()


def test_a_map_that_is_at_hand_and_one_that_is_made_anew_are_the_same(monkeypatch) -> None:
    monkeypatch.setattr(loops, "MAX_CACHE_BYTES", 0)  # one is kept
    reading = loops.mapped(room())
    panorama, wide = mapped(HERE, seed=1).panorama(), about((0.3, 0.3, 0.1))
    ready, anew = Matcher(Loops()), Matcher(Loops())
    place, hall = room(), mapped(POSES[:3])
    ready.keep(place, reading)
    expected = anew.match(place, panorama, TRUTH, wide)
    for matcher in (ready, anew):
        for _ in range(2):
            found = matcher.match(place, panorama, TRUTH, wide)
            assert found.pose == expected.pose
            np.testing.assert_array_equal(found.information, expected.information)
            most = matcher.nbytes
            matcher.match(hall, panorama, TRUTH, wide)  # the place is packed away
            assert list(matcher._unpacked) == [hall]
            assert matcher.nbytes < 2 * most


@pytest.mark.parametrize(
    "wrong", [{"sigmas": 0.0}, {"explained": -1.0}, {"contradicted": math.nan}]
)
def test_loops_are_checked(wrong) -> None:
    with pytest.raises(InputError, match="Loops"):
        Loops(**wrong)


@pytest.mark.parametrize("heading", [0.0, 0.3, 1.2, -2.0])
def test_along_a_passage_little_is_believed(heading: float) -> None:
    c, s = np.cos(heading), np.sin(heading)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    passage = np.array([[1600.0, 0.0, 40.0], [0.0, 9000.0, 30.0], [40.0, 30.0, 5000.0]])
    found = turn.T @ cautious(turn @ passage @ turn.T) @ turn
    assert found[0, 0] == pytest.approx(loops.CORRIDOR_STD**-2)
    np.testing.assert_allclose(found[1:, 1:], passage[1:, 1:], rtol=1e-9)
    assert np.linalg.eigvalsh(found).min() >= 0.0
    for other in (np.diag([4000.0, 9000.0, 5000.0]), np.diag([0.2, 9000.0, 5000.0])):
        np.testing.assert_array_equal(cautious(other), other)  # a room; what is weak already


def with_niches(spacing: float) -> np.ndarray:
    """The walls of a corridor along x with a niche in one side, and another one each `spacing`."""
    walls = [(-40.0, -1.0, 40.0, -1.0)]
    corners = [(-40.0, 1.0)]
    for x in np.arange(0.0, 30.0, spacing):
        corners += [(x, 1.0), (x, 1.4), (x + 0.6, 1.4), (x + 0.6, 1.0)]
    corners.append((40.0, 1.0))
    return np.array(walls + [(*a, *b) for a, b in pairwise(corners)])


def deviation_along(walls: np.ndarray, doubt: float) -> float:
    """m, by a match that is 1.4 m farther along a corridor, known with a deviation of `doubt`."""
    angles, places = np.radians(np.arange(-120, 121)), []
    for begin, number in ((0.0, 30), (1.4, 5)):
        poses = [Pose2(5.0 + begin + 0.1 * k, 0.0, 0.0) for k in range(number)]
        place = LocalMap((), scan_at(poses[0], 0.0, angles, walls))
        for pose in poses[1:]:
            place.add(scan_at(pose, 0.0, angles, walls), poses[0].between(pose))
        places.append(place)
    covariance = about((doubt, 0.1, 0.02))
    match = Matcher(Loops()).match(places[0], places[1].panorama(), Pose2(1.4), covariance)
    along, across, turn = np.sqrt(np.diag(np.linalg.inv(match.information)))
    assert across < 0.03
    assert turn < 0.01
    return float(along)


def test_where_other_places_are_nearly_as_likely_a_match_knows_less() -> None:
    """Along a passage with niches alike, a loop of a long way may close at any of them."""
    alike = with_niches(0.8)
    assert deviation_along(alike, 2.0) > 0.4
    assert deviation_along(alike, 0.1) < 0.03
    assert deviation_along(CORRIDOR, 0.1) > loops.CORRIDOR_STD + 0.2


def test_climbs_that_end_at_one_place_count_once() -> None:
    there, away = Pose2(1.0, 2.0, math.pi / 2), Pose2(1.0, 4.0, math.pi / 2)  # 2 m ahead
    poses, values = [there, away, there @ Pose2(0.01), away @ Pose2(0.01)], np.zeros(4)
    expected = np.diag([2.0, 0.0, 0.0])  # half of 2 m squared
    np.testing.assert_allclose(loops._spread(poses, values, 0), expected, atol=1e-9)
    alone = loops._spread(poses[::2], values[::2], 1)
    np.testing.assert_array_equal(alone, np.zeros((3, 3)))
    less = loops._spread(poses[:2], np.array([0.0, -math.log(3.0)]), 0)
    np.testing.assert_allclose(less, np.diag([1.0, 0.0, 0.0]), atol=1e-9)


def test_along_a_passage_with_doors_alike_the_likeliest_place_closes_the_loop() -> None:
    """In the coarse map of the search a place 0.48 m off looks best; half of that bent the path."""
    episode = record_path("DoorLoop-v0", 7702, difficulty="hard")
    result = run(make("dynamic-graph", true_start(episode)), episode)
    away = result.poses - episode.known_truth("this test").poses
    assert np.hypot(*away[:, :2].T).max() < 0.05
