"""Scores of the probability to be lost, against naive counts and by hand."""

import json
import math

import numpy as np
import pytest
from scipy import stats

from slam import InputError, interface
from slam.metrics import lost as module
from slam.metrics.lost import (
    Loss,
    auroc,
    auroc_of_counts,
    calibration_error,
    false_alarms,
    had_time,
    is_wrong,
    losses,
    may_be_drawn,
    pooled,
    rank_counts,
    reliability,
    score_lost,
    told_in_time,
)

RNG = np.random.default_rng(0)
TIMES = np.arange(100) / 10


def flags(*spans, n=100):
    found = np.zeros(n, dtype=bool)
    for first, after in spans:
        found[first:after] = True
    return found


def test_a_pose_is_wrong_by_the_limits_of_the_interface():
    assert module.LOST_DISTANCE == interface.LOST_DISTANCE
    assert module.LOST_TURN == interface.LOST_TURN
    truth = np.tile([1.0, 2.0, math.pi], (5, 1))
    off = np.array([(0.2, 0.2, 0), (0.2, 0.25, 0), (0, 0, 0.17), (0, 0, 0.18), (0, 0, math.tau)])
    assert is_wrong(truth + off, truth).tolist() == [False, True, False, True, False]


# -- when --------------------------------------------------------------------------------------


def test_a_loss_is_told_by_the_first_alarm_in_it():
    found = losses(TIMES, flags((20, 50)), flags((5, 10), (27, 30), (60, 70)))
    assert found == [Loss(2.0, 5.0, 2.7, 9.9)]


def test_an_alarm_before_the_loss_tells_it_at_once():
    assert losses(TIMES, flags((20, 50)), flags((15, 22))) == [Loss(2.0, 5.0, 2.0, 9.9)]


def test_losses_that_are_not_told_or_never_end():
    found = losses(TIMES, flags((0, 10), (90, 100)), flags((40, 50), (95, 96)))
    assert found == [Loss(0.0, 1.0, None, 9.9), Loss(9.0, None, 9.5, 9.9)]


def test_short_times_of_right_poses_do_not_end_a_loss():
    """19 scans from the last wrong pose to the next, 1.9 s; then 20 scans, 2 s."""
    assert losses(TIMES, flags((10, 20), (38, 40)), flags()) == [Loss(1.0, 4.0, None, 9.9)]
    assert len(losses(TIMES, flags((10, 20), (39, 41)), flags())) == 2


def test_scans_that_follow_one_another_slowly_are_one_loss():
    assert losses(10 * TIMES, flags((10, 14)), flags()) == [Loss(10.0, 14.0, None, 99.0)]


@pytest.mark.parametrize(
    ("told", "in_time"), [(None, False), (1.0, True), (6.0, True), (6.1, False)]
)
def test_told_in_time_is_within_five_seconds(told, in_time):
    assert told_in_time(Loss(1.0, None, told)) is in_time


def test_a_loss_just_before_the_end_could_not_be_told_in_time():
    early, late = losses(TIMES, flags((0, 10), (60, 100)), flags())
    assert had_time(early)
    assert not had_time(late)


def test_what_a_slam_may_have_withheld_is_no_reference():
    times = np.arange(20.0)
    lost = np.zeros(20)
    lost[12] = 0.9  # told at 12 s
    lost[3] = 0.3  # doubted
    assert np.flatnonzero(~may_be_drawn(times, lost)).tolist() == [3, 7, 8, 9, 10, 11, 12]
    assert may_be_drawn(times, np.zeros(20)).all()


def test_false_alarms_are_counted_once_and_only_where_all_was_right():
    wrong = flags((50, 60))
    assert false_alarms(TIMES, wrong, flags((0, 10))) == 1
    assert false_alarms(TIMES, wrong, flags((0, 3), (10, 12), (20, 25))) == 1  # one, interrupted
    assert false_alarms(TIMES, wrong, flags((0, 3), (30, 32))) == 2
    assert false_alarms(TIMES, wrong, flags((45, 52))) == 0
    assert false_alarms(TIMES, wrong, flags((58, 70), (95, 96))) == 1
    assert false_alarms(TIMES, wrong, flags()) == 0


# -- calibration and ranks ---------------------------------------------------------------------


@pytest.mark.parametrize("levels", [3, 11, 10**6])
def test_auroc_is_the_share_of_pairs_in_order(levels):
    told = RNG.integers(0, levels + 1, 400) / levels
    wrong = RNG.random(400) < 0.2 + 0.5 * told
    pairs = np.subtract.outer(told[wrong], told[~wrong])
    assert auroc(told, wrong) == pytest.approx(((pairs > 0) + 0.5 * (pairs == 0)).mean())
    u = stats.mannwhitneyu(told[wrong], told[~wrong]).statistic
    assert auroc(told, wrong) == pytest.approx(u / pairs.size)


def test_auroc_of_extremes():
    wrong = flags((0, 10), n=40)
    assert auroc(wrong.astype(float), wrong) == 1.0
    assert auroc(1.0 - wrong, wrong) == 0.0
    assert auroc(np.full(40, 0.3), wrong) == 0.5
    assert math.isnan(auroc(np.full(40, 0.3), flags(n=40)))
    assert math.isnan(auroc_of_counts([0, 0], [3, 1]))


def test_auroc_of_bins_is_close_to_the_exact_one():
    told = 1 / (1 + np.exp(-RNG.normal(0.0, 4.0, 3000)))
    wrong = RNG.random(3000) < told
    found = rank_counts(told, wrong)
    assert sum(found.right) + sum(found.wrong) == 3000
    assert sum(found.wrong) == wrong.sum()
    assert auroc_of_counts(*found) == pytest.approx(auroc(told, wrong), abs=2e-3)
    ends = rank_counts(np.array([0.0, 1.0]), np.array([False, True]))
    assert (ends.right[0], ends.wrong[-1]) == (1, 1)


def test_the_diagram_by_hand():
    told = np.array([0.0, 0.05, 0.1, 0.95, 1.0, 1.0])
    wrong = np.array([False, True, False, True, True, False])
    found = reliability(told, wrong)
    assert found.scans == [2, 1, 0, 0, 0, 0, 0, 0, 0, 3]
    assert found.told[:2] + found.told[9:] == pytest.approx([0.025, 0.1, 2.95 / 3])
    assert found.wrong[:2] + found.wrong[9:] == pytest.approx([0.5, 0.0, 2 / 3])
    expected = (2 * 0.475 + 1 * 0.1 + 3 * (2.95 - 2) / 3) / 6
    assert calibration_error(found) == pytest.approx(expected)


def test_probabilities_that_come_true_are_calibrated():
    told = RNG.random(200_000)
    right = reliability(told, RNG.random(200_000) < told)
    assert calibration_error(right) < 0.006
    bold = reliability(told, RNG.random(200_000) < 0.5)
    assert calibration_error(bold) == pytest.approx(0.25, abs=0.01)


def test_diagrams_of_runs_are_pooled_by_their_scans():
    told, wrong = RNG.random(700), RNG.random(700) < 0.4
    parts = [reliability(told[a:b], wrong[a:b]) for a, b in ((0, 50), (50, 400), (400, 700))]
    whole, found = reliability(told, wrong), pooled(parts)
    assert found.scans == whole.scans
    assert found.told == pytest.approx(whole.told)
    assert found.wrong == pytest.approx(whole.wrong)


# -- all of a run ------------------------------------------------------------------------------


def test_all_scores_of_a_run():
    truth = np.zeros((100, 3))
    poses, told = truth.copy(), np.zeros(100)
    poses[30:60, 1] = 0.5
    told[40:60], told[80:90] = 0.9, 0.8
    found = score_lost(TIMES, poses, truth, told)
    assert found.lost_share == pytest.approx(0.3)
    assert not found.lost_at_end
    assert found.sure_and_wrong == pytest.approx(0.1)
    assert found.brier == pytest.approx((10 * 1 + 20 * 0.01 + 10 * 0.64) / 100)
    assert found.false_alarms == 1
    assert found.hours_right == pytest.approx((9.9 - 3.0) / 3600)
    assert found.losses == [Loss(3.0, 6.0, 4.0, 9.9)]
    assert found.auroc == pytest.approx((20 * 70 + 10 * 60 / 2) / (30 * 70))
    plain = json.loads(json.dumps(found.as_dict(), allow_nan=False))
    assert plain["losses"] == [{"begin": 3.0, "end": 6.0, "told": 4.0, "until": 9.9}]
    assert plain["reliability"]["scans"] == found.reliability.scans


def test_a_run_without_a_wrong_pose_has_no_auroc():
    truth = np.zeros((5, 3))
    found = score_lost(TIMES[:5], truth, truth, np.zeros(5))
    assert (found.lost_share, found.brier, found.losses) == (0.0, 0.0, [])
    assert found.as_dict()["auroc"] is None
    end = score_lost(TIMES[:5], truth + 1.0, truth, np.zeros(5))
    assert end.lost_at_end
    assert (end.sure_and_wrong, end.brier) == (0.0, 0.0)  # all of the map is off by as much


@pytest.mark.parametrize(
    ("told", "message"),
    [
        (np.array([0.0, 1.1]), "must be a probability"),
        (np.array([0.0, math.nan]), "must be a probability"),
        (np.zeros(3), "one `lost` a scan"),
    ],
)
def test_what_is_no_probability_is_refused(told, message):
    with pytest.raises(InputError, match=message):
        score_lost(np.arange(2.0), np.zeros((2, 3)), np.zeros((2, 3)), told)


def test_poses_of_other_numbers_are_refused():
    with pytest.raises(InputError, match=r"poses \(n, 3\)"):
        score_lost(np.arange(2.0), np.zeros((3, 3)), np.zeros((2, 3)), np.zeros(2))
    with pytest.raises(InputError, match="one pose a scan, got 3 for 2"):
        score_lost(np.arange(2.0), np.zeros((3, 3)), np.zeros((3, 3)), np.zeros(2))
