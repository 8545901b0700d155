# pyright: reportMissingImports=false
import numpy as np
import pytest
from dynslam_cli.studies import belief_drive
from dynslam_cli.studies.belief_study import calibration_error, reliability, scores, table


def filled(p, shut, squared, count=100.0):
    """Sums of one drive whose `fresh` doors all have P(closed) = p in both beliefs."""
    sums = np.zeros((3, 2, 10, 4))
    for b in range(2):
        sums[0, b, int(10 * p[b])] = count, count * p[b], count * shut, count * squared[b]
    return sums


def test_scores_are_those_counted_by_hand():
    sums = np.array([filled((0.9, 0.5), 0.9, (0.09, 0.25)), filled((0.9, 0.5), 0.5, (0.41, 0.25))])
    old, new, gap = scores(sums[:, 0])
    assert (old, new) == pytest.approx((0.25, 0.25))
    assert gap == pytest.approx(0.25 - 0.7 * 0.3)
    assert calibration_error(sums[:, 0, 0].sum(axis=0)) == pytest.approx(0.2)


def test_a_short_drive_gives_a_row_that_the_table_and_the_plot_take(monkeypatch, tmp_path):
    monkeypatch.setitem(belief_drive.DURATIONS, "fast", 8.0)
    (row,) = belief_drive.drive("corridor", "fast", "lookout", 3)
    sums = np.array(row["sums"])
    assert sums[:, 0, :, 0].sum() == sums[:, 1, :, 0].sum() == 10 * 8  # scorings of 8 doors
    assert (sums[..., 3] <= sums[..., 0]).all()
    text = table([row])
    assert "corridor, fast, lookout (1 drives, 0 lost)" in text
    assert "fresh" in text
    assert "never" in text
    reliability([row], tmp_path / "reliability.png")
    assert (tmp_path / "reliability.png").stat().st_size > 10_000
