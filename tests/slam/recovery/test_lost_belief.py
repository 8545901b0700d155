"""The probability of being lost, from the agreement of scans and map."""

import pytest

from slam.recovery.agreement import Agreement
from slam.recovery.lost_belief import LostBelief
from slam.recovery.signs import Sign
from slam.recovery.watch import DOUBTED

USUAL, CHANGED, STRANGE = Agreement(0.92, 0.02), Agreement(0.8, 0.1), Agreement(0.15, 0.5)


def after(belief: LostBelief, agreement: Agreement, keyframes: int, change: float = 0.0) -> float:
    for _ in range(keyframes):
        belief.update(agreement, change)
        if belief.probability < DOUBTED:
            belief.learn(agreement, -0.1, change)
    return belief.probability


@pytest.fixture
def belief() -> LostBelief:
    """A belief that has seen what is usual."""
    belief = LostBelief()
    after(belief, USUAL, 60)
    return belief


def test_where_all_is_well_the_robot_is_not_lost(belief):
    assert after(belief, USUAL, 1000) < 1e-4


def test_a_door_that_moved_is_no_loss(belief):
    assert after(belief, CHANGED, 30) < 0.005


def test_scans_that_agree_with_nothing_are(belief):
    assert after(belief, STRANGE, 10) > 0.5


def test_a_scan_that_is_not_continuous_is_a_doubt_at_once(belief):
    assert after(belief, CHANGED, 1, change=0.3) > 0.05
    assert belief.sign is Sign.SCAN
    assert after(belief, USUAL, 15) < 0.005


@pytest.mark.parametrize("explained", [0.75, 0.7])
@pytest.mark.parametrize("continuous", [True, False])
def test_a_map_that_explained_a_scan_and_contradicts_the_next_is_a_doubt_at_once(
    belief, continuous, explained
):
    """Scans that are far apart see different parts of the map, which may be as different."""
    belief.update(Agreement(explained, 0.2), 0.0, continuous=continuous, arriving=True)
    assert belief.sign is (Sign.TURN if continuous else None)


def test_scans_that_see_different_parts_of_the_map_give_no_sign_by_it(belief):
    belief.update(Agreement(0.7, 0.03), 0.0, continuous=False)
    assert belief.sign is None


@pytest.mark.parametrize("arriving", [True, False])
def test_a_map_that_explains_far_less_at_once_is_a_doubt_but_on_the_way_from_new_ground(
    belief, arriving
):
    belief.update(Agreement(0.7, 0.03), 0.0, arriving=arriving)
    assert belief.sign is (None if arriving else Sign.FADE)


def test_a_map_that_often_explains_far_less_means_nothing(belief):
    for _ in range(10):
        after(belief, USUAL, 1)
        belief.update(Agreement(0.6, 0.03), 0.0)
        belief.dismiss(Sign.FADE)
    after(belief, USUAL, 1)
    belief.update(Agreement(0.7, 0.03), 0.0)
    assert belief.sign is None
    belief.update(Agreement(0.5, 0.3), 0.0)
    assert belief.sign is Sign.TURN


def test_a_share_that_always_changes_is_usual():
    belief = LostBelief()
    for _ in range(60):
        after(belief, Agreement(0.92, 0.02), 1)
        after(belief, Agreement(0.84, 0.02), 1)
    belief.update(Agreement(0.92, 0.02), 0.0)
    belief.update(Agreement(0.7, 0.02), 0.0)
    assert belief.sign is None


def test_odometry_that_failed_is_a_doubt_whatever_the_map_tells(belief):
    belief.update(USUAL, 0.0, sudden=True)
    assert belief.sign is Sign.SCAN


def test_a_map_that_is_ever_less_sure_is_none(belief):
    for share in (0.85, 0.75, 0.65):
        belief.update(Agreement(share, 0.95 - share), 0.0)
        assert belief.sign is None


def test_scans_that_always_change_are_usual():
    belief = LostBelief()
    after(belief, Agreement(0.7, 0.15), 60, change=0.3)
    assert after(belief, Agreement(0.7, 0.15), 1, change=0.4) < 0.005
    assert belief.sign is None


def test_poor_agreement_is_usual_in_some_recordings():
    belief = LostBelief()
    after(belief, Agreement(0.5, 0.1), 100)
    assert belief.evidence(Agreement(0.5, 0.1)) < -1.0
    assert belief.evidence(Agreement(0.2, 0.3)) > 1.0


def test_unknown_echoes_are_no_evidence(belief):
    assert belief.evidence(Agreement(0.0, 0.0)) == 0.0
