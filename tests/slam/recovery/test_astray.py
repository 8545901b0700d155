"""A robot that is found at no place of the map goes on on new ground, and elsewhere stays lost."""

from dataclasses import replace

import numpy as np
import pytest

from slam.algorithms.dead_reckoning import DeadReckoning
from slam.geometry import Pose2
from slam.interface import Estimate
from slam.recovery.agreement import Agreement
from slam.recovery.astray import (
    CLEARLY_BETTER,
    LASTING,
    LONGER,
    REPEATED,
    SEEN,
    Astray,
    Attempt,
)
from slam.recovery.demands import GRADUAL, SUDDEN, Demands
from slam.recovery.places import Place, Places, Surroundings
from slam.scan import Scan
from tests.slam.recovery.drawn_room import reading, room

BESIDE = Pose2(6.0, 0.0, 0.0)  # the known room, 4 x 3 m around the origin
STEP = Pose2(0.2, 0.0, 0.0)


class Turning(DeadReckoning):
    """A SLAM of a robot that comes back to where it stood: only the odometry tells of the way."""

    def update(self, displacement: Pose2, scan: Scan) -> Estimate:
        return Estimate(Pose2(), np.zeros((3, 3)), 0.0, True)


def driven(demands: Demands) -> tuple[Astray, float]:
    """A robot in a room like the known one, which has two places for each scan, that believes to be
    beside it; and after how many metres it went on, infinite if it did not."""
    astray = Astray(Turning(), Surroundings(reading(), Pose2()), BESIDE, 0.95, demands)
    for k in range(round(2.0 * demands.new_ground / STEP.x)):
        scan = replace(room(), time=float(k))
        astray.update(STEP, scan)
        if astray.found(scan.time) is not None:
            return astray, (k + 1) * STEP.x
    return astray, np.inf


@pytest.mark.parametrize("demands", [SUDDEN, GRADUAL])
def test_it_goes_on_on_new_ground_and_is_not_sure(demands: Demands) -> None:
    astray, metres = driven(demands)
    assert metres == pytest.approx(demands.new_ground, abs=1.0)
    assert not astray.sure
    assert np.sqrt(astray.covariance[0, 0]) > 0.3


def test_it_stays_lost_where_known_ground_did_not_agree_with_it() -> None:
    assert driven(SUDDEN._replace(no_new_ground=True))[1] == np.inf


def test_a_place_that_is_being_confirmed_comes_before_new_ground() -> None:
    astray = Astray(Turning(), Surroundings(reading(), Pose2()), BESIDE, 0.95)
    there = astray._places.matched(room(), Pose2())
    found, origin = iter([None] * 10 + [there] * 10), None
    astray._attempt = lambda scan, believed: Attempt(next(found), 5)
    for k in range(15):
        scan = replace(room(), time=2.0 * k)
        astray.update(Pose2(0.95, 0.0, 0.0), scan)
        origin = astray.found(scan.time)
        if origin is not None:
            break
    assert astray.sure
    assert origin == there.pose


def test_a_path_through_a_wall_is_told_from_one_on_new_ground() -> None:
    places = Places(reading(), known=True)
    inside, through, beyond = [[-1.5, 0.3], [1.5, -0.3]], [[0.0, 0.0], [4.0, 0.1]], [[3, 0], [9, 4]]
    assert not places.crossed(np.array(inside))
    assert places.crossed(np.array(through))
    assert not places.crossed(np.array(beyond, np.float64))
    assert not places.crossed(np.zeros((1, 2)))


def beside(demands: Demands = SUDDEN) -> Astray:
    """A lost robot that believes to be beside the known room, and has driven for 7 m."""
    astray = Astray(Turning(), Surroundings(reading(), Pose2()), BESIDE, 0.95, demands)
    for k in range(35):
        astray.update(STEP, replace(room(), time=float(k)))
    return astray


def test_where_the_ground_may_be_new_a_place_that_is_not_alone_must_be_found_longer() -> None:
    for demands, attempts in (
        (SUDDEN, LONGER),
        (SUDDEN._replace(no_new_ground=True), REPEATED),
    ):
        astray, good = beside(demands), Agreement(0.9, 0.0)
        first, second = Place(Pose2(0.0), -20.0, good), Place(Pose2(0.0, 5.0), -28.0, good)
        astray._places.all = lambda scan, explained, both=(first, second): list(both)
        assert astray._attempt(room(), BESIDE) == Attempt(first, attempts)


@pytest.mark.parametrize(("contradicted", "attempts"), [(0.02, LONGER), (0.15, 2)])
def test_another_place_must_be_found_longer_where_the_believed_one_is_not_contradicted(
    contradicted: float, attempts: int
) -> None:
    here = Place(BESIDE, -90.0, Agreement(0.5, contradicted))
    assert beside()._times(30.0, True, here) == attempts
    assert beside()._times(30.0, False, here) == LONGER
    assert beside(SUDDEN._replace(torn=True))._times(30.0, True, here) == 2
    assert beside(SUDDEN._replace(torn=True))._times(30.0, False, here) == LONGER
    assert beside(SUDDEN._replace(no_new_ground=True))._times(30.0, True, here) == 2


@pytest.mark.parametrize(
    ("gain", "explained", "found"),
    [(CLEARLY_BETTER + 1.0, 0.76, True), (20.0, 0.76, False), (20.0, 0.85, True)],
)
def test_a_place_must_explain_nearly_all_unless_it_is_clearly_better(
    gain: float, explained: float, found: bool
) -> None:
    astray = beside(SUDDEN._replace(no_new_ground=True))
    here = Place(BESIDE, -90.0, Agreement(0.5, 0.1))
    there = Place(Pose2(), -90.0 + gain, Agreement(explained, 0.02))
    astray._places.all = lambda scan, explained: [there]
    astray._places.matched = lambda scan, start: here
    assert astray._attempt(room(), BESIDE).place == (there if found else None)


def test_the_place_to_which_the_believed_one_climbs_need_not_be_better_than_it() -> None:
    astray = beside(SUDDEN._replace(no_new_ground=True))
    drifted = Place(BESIDE @ Pose2(0.8), -90.0, Agreement(0.76, 0.02))
    astray._places.all = lambda scan, explained: [drifted]
    astray._places.matched = lambda scan, start: drifted
    assert astray._attempt(room(), BESIDE).place == drifted


@pytest.mark.parametrize(
    ("demands", "explained", "found"),
    [(SUDDEN, 0.02, False), (SUDDEN, 0.85, True), (GRADUAL, 0.02, True)],
)
def test_the_believed_place_is_not_proven_by_a_place_that_fits_worse(
    demands: Demands, explained: float, found: bool
) -> None:
    astray, worse = beside(demands), Place(Pose2(), -100.0, Agreement(0.25, 0.4))
    here = Place(BESIDE, -90.0, Agreement(explained, 0.02))
    astray._places.all = lambda scan, explained: [worse]
    astray._places.matched = lambda scan, start: here
    assert astray._attempt(room(), BESIDE).place == (here if found else None)


@pytest.mark.parametrize(
    ("off", "continuous", "near"), [(0.5, True, True), (2.0, True, False), (0.5, False, False)]
)
def test_a_place_near_the_believed_one_is_likelier_if_no_scan_tells_that_it_was_carried(
    off: float, continuous: bool, near: bool
) -> None:
    astray = beside(SUDDEN._replace(no_new_ground=True, continuous=continuous))
    here = Place(BESIDE @ Pose2(off), -26.0, Agreement(0.9, 0.02))
    there = Place(Pose2(), -20.0, Agreement(0.9, 0.02))
    astray._places.all = lambda scan, explained: [there, here]
    astray._places.matched = lambda scan, start: here
    assert astray._attempt(room(), BESIDE).place == (here if near else there)


@pytest.mark.parametrize(("likely", "attempts"), [(20.0, 2), (4.0, LONGER)])
def test_where_a_loop_closes_a_place_that_is_not_likely_must_be_found_longer(
    likely: float, attempts: int
) -> None:
    """The true place may be new ground still, and another one that looks alike well known."""
    known = SUDDEN._replace(no_new_ground=True, likely=likely)
    astray, there = beside(known), Place(Pose2(), -20.0, Agreement(0.9, 0.02))
    astray._places.all = lambda scan, explained: [there]
    astray._places.matched = lambda scan, start: Place(BESIDE, -90.0, Agreement(0.1, 0.3))
    assert astray._attempt(room(), BESIDE) == Attempt(there, attempts)
    assert attempts_to_find(0.5, known) == (np.inf if attempts == LONGER else LASTING)


def test_ground_behind_a_wall_is_not_new() -> None:
    astray, beyond = beside(), Agreement(0.0, 0.0)
    assert astray._may_be_new(Place(BESIDE, -90.0, beyond), astray.believed)
    astray.believed = Pose2(1.0, 0.0, 0.0)  # in the known room, from where it drives through a wall
    astray.keyframes.append(astray.keyframes[-1]._replace(pose=Pose2(3.0, 0.0, 0.0)))
    assert not astray._may_be_new(Place(BESIDE, -90.0, beyond), astray.believed)


def attempts_to_find(explained: float, demands: Demands, *, moving: bool = False) -> float:
    """Attempts until a place is accepted that contradicts more than is allowed, and is the best."""
    astray = Astray(Turning(), Surroundings(reading(), Pose2()), BESIDE, 0.95, demands)
    for k in range(2 * LASTING):
        astray.update(Pose2(), replace(room(), time=2.5 * k))
        there = Pose2(-8.0, k * float(moving), 0.0)
        place = Place(there, -20.0, Agreement(explained, 0.4))
        astray._places.all = lambda scan, explained, one=place: [one]
        if astray.found(2.5 * k) is not None:
            assert astray.sure
            return k + 1
    return np.inf


def test_a_place_that_stays_the_best_is_found_though_the_map_has_changed_there() -> None:
    known = SUDDEN._replace(no_new_ground=True)
    assert attempts_to_find(0.5, known) == LASTING
    assert attempts_to_find(0.5, known, moving=True) == np.inf
    assert attempts_to_find(0.4, known) == np.inf
    assert attempts_to_find(0.5, SUDDEN) == np.inf  # it may be on new ground


UNKNOWN, KNOWN = Agreement(0.1, 0.0), Agreement(0.4, 0.3)


def goes_on(
    attempts: int, place: Place, demands: Demands = SUDDEN, later: Agreement = UNKNOWN
) -> tuple[Pose2 | None, int]:
    """Where a robot goes on that finds a place so many times, and then none; and after how many
    attempts. The map agrees `later` with what it sees there."""
    astray = beside(demands)
    for k in range(60):
        astray.update(Pose2(1.0), replace(room(), time=2.5 * k))
        found = place if k < attempts else None
        astray._attempt = lambda scan, believed, one=found: Attempt(one, LONGER)
        astray._places.matched = lambda scan, start: Place(start, -90.0, later)
        origin = astray.found(2.5 * k)
        if origin is not None:
            assert not astray.sure
            return origin, k
    return None, 60


WELL = Place(Pose2(-8.0), -20.0, Agreement(0.85, 0.02))


def test_a_robot_that_leaves_the_map_where_it_was_found_goes_on_there() -> None:
    origin, attempts = goes_on(SEEN, WELL)
    assert origin == WELL.pose
    assert SEEN + 9 <= attempts < 20
    less = WELL._replace(agreement=Agreement(0.75, 0.02))
    for seen, place in ((SEEN - 1, WELL), (SEEN, less)):
        origin, attempts = goes_on(seen, place)
        assert origin == BESIDE
        assert attempts > 20


def test_it_does_not_go_on_where_the_map_knows_the_ground() -> None:
    assert goes_on(SEEN, WELL, later=KNOWN) == (None, 60)


def test_it_does_not_go_on_where_errors_of_a_loop_do_not_lead() -> None:
    assert goes_on(SEEN, WELL, SUDDEN._replace(likely=5.0))[0] == BESIDE
    assert goes_on(SEEN, WELL, SUDDEN._replace(likely=50.0))[0] == WELL.pose
