"""What tells a failure of the odometry from a place that has changed."""

from unittest import mock

import numpy as np
import pytest

from slam.geometry import Pose2
from slam.recovery.agreement import Agreement
from slam.recovery.continuity import RECENT
from slam.recovery.lost_belief import LostBelief
from slam.recovery.odometry_failure import OLDEST, OdometryFailure, _shown_at_once, evidence
from slam.recovery.wide_search import WideSearch

USUAL = np.full(RECENT, 0.97)


@pytest.fixture
def failure() -> OdometryFailure:
    return OdometryFailure(LostBelief(), WideSearch())


def seen(*shares: float, echoes: int = 100) -> np.ndarray:
    return np.column_stack([shares, np.full(len(shares), echoes)])


def after(failure: OdometryFailure, overlaps: list[np.ndarray]) -> list[float]:
    return [failure.fall(one.tolist()) for one in overlaps]


def test_a_slip_lets_the_overlap_with_all_scans_before_it_fall(failure):
    falls = after(failure, [USUAL] * 20 + [np.array([0.97, 0.97, 0.88, 0.88, 0.87])])
    assert max(falls[10:20]) < 0.02
    assert falls[20] > 0.07


def test_it_is_seen_at_once_at_the_scan_after_it(failure):
    assert after(failure, [USUAL] * 20 + [np.full(RECENT, 0.85)])[-1] > 0.08


def test_new_ground_lets_it_fall_step_by_step(failure):
    falls = after(failure, [USUAL] * 20 + [np.array([0.95, 0.88, 0.81, 0.75, 0.68])])
    assert falls[-1] < 0.02


def test_few_scans_prove_nothing_but_the_latest_may_disprove(failure):
    assert failure.fall([0.9, 0.2]) == 0.0
    assert evidence(seen(0.2, 0.9), seen(0.9, 0.9)) == 0.0
    assert evidence(seen(0.9, 0.2), seen(0.2, 0.9)) == pytest.approx(-35.0)
    assert evidence(seen(), seen()) == 0.0


def test_a_scan_before_the_failure_speaks_for_the_correction():
    found, corrected = seen(0.98, 0.88, 0.88, 0.88, 0.88), seen(0.88, 0.98, 0.98, 0.98, 0.98)
    assert evidence(found, corrected) == pytest.approx(5.0)  # nats: half of each of 10 echoes


def test_few_echoes_in_view_are_little_evidence():
    found = seen(0.98, 0.88, 0.88, 0.88, 0.88)
    corrected = seen(0.88, 0.98, 0.98, 0.98, 0.98, echoes=20)
    assert evidence(found, corrected) == pytest.approx(1.0)


def test_scans_that_all_agree_less_speak_against_it():
    assert evidence(seen(*USUAL), seen(*(USUAL - 0.1))) == pytest.approx(-5.0)
    assert evidence(seen(*USUAL), seen(*(USUAL - 0.3))) < -10.0


def test_an_earlier_scan_that_hardly_agrees_is_no_witness():
    found = seen(0.98, 0.9, 0.7, 0.5, 0.3)
    corrected = seen(0.5, 0.5, 0.5, 0.6, 0.7)  # a little better, far from what agrees
    assert evidence(found, corrected) < -10.0


def test_a_large_failure_shows_at_the_latest_scan():
    slipped, true = seen(0.5, 0.5, 0.5, 0.5, 0.5), seen(0.97, 0.97, 0.97, 0.97, 0.97)
    assert _shown_at_once(slipped, true)
    door = seen(0.93, 0.84, 0.82, 0.81, 0.79)  # it opens more and more
    assert not _shown_at_once(door, true)
    assert not _shown_at_once(slipped, seen(0.97, 0.97, 0.97, 0.97, 0.97, echoes=20))


def test_a_person_who_walks_along_proves_nothing_to_the_oldest_scans():
    found, along = seen(0.83, 0.82, 0.79, 0.79, 0.78), seen(1.0, 0.99, 0.89, 0.8, 0.79)
    assert evidence(found, along) > 8.0
    assert evidence(found, along, OLDEST) < 1.0


HERE, NEAR, FAR = Pose2(), Pose2(0.3), Pose2(0.8)
USUALLY, LITTLE = Agreement(0.9, 0.02), Agreement(0.5, 0.02)
CONTRADICTED = Agreement(0.3, 0.3)
AGREEING, PROVING = seen(0.96, 0.9, 0.85, 0.8, 0.8), seen(0.97, 0.97, 0.97, 0.97, 0.97)


def accepted(
    failure: OdometryFailure, pose: Pose2, there: Agreement, overlaps: np.ndarray, corrected
) -> bool:
    """Whether a match that the map contradicts is corrected to where it agrees so well."""
    match = mock.Mock()
    match.estimate.pose = HERE
    match.agreement = lambda at: CONTRADICTED if at == HERE else there
    return failure._accepted(match, pose, overlaps, corrected)


def test_a_large_correction_must_be_shown_by_the_latest_scan_if_it_can(failure):
    assert not accepted(failure, FAR, USUALLY, seen(*[0.5] * RECENT), seen(*[0.55] * RECENT))
    assert accepted(failure, FAR, USUALLY, seen(*[0.5] * RECENT), PROVING)
    assert accepted(failure, FAR, USUALLY, AGREEING, PROVING)  # it cannot: too much agrees with it
    assert not accepted(failure, FAR, USUALLY, np.empty((0, 2)), np.empty((0, 2)))
    assert accepted(failure, NEAR, USUALLY, np.empty((0, 2)), np.empty((0, 2)))


@pytest.mark.parametrize(
    ("pose", "there", "best", "taken"),
    [
        (NEAR, LITTLE, 0.75, True),
        (NEAR, Agreement(0.35, 0.02), 0.75, False),  # hardly more is explained
        (NEAR, Agreement(0.5, 0.2), 0.75, False),  # it is contradicted there, too
        (NEAR, LITTLE, 0.52, False),  # no scan before proves it
        (FAR, LITTLE, 0.92, True),  # one of them saw nearly as much as usual
        (FAR, LITTLE, 0.75, False),
    ],
)
def test_a_correction_is_taken_where_the_map_stops_contradicting(failure, pose, there, best, taken):
    found, corrected = seen(*[0.5] * RECENT), seen(best, *[0.5] * (RECENT - 1))
    assert accepted(failure, pose, there, found, corrected) == taken
