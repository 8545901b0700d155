# pyright: reportMissingImports=false
"""The heat map shows each hour's rate, and where nobody looked."""

import numpy as np
from dynslam_cli.figures.week_figure import Calibration, week_figure

from slam import DoorForecast
from slam.metrics.lost import Reliability
from tests.slam.forecast.habits import HOUR, MONDAY, office, runs_of


def test_the_numbers_are_those_of_the_week() -> None:
    week = DoorForecast.fit(*runs_of(office(3))).to_dict()
    figure = week_figure(week)
    shown = np.array([text.get_text() for text in figure.axes[0].texts], float).reshape(7, 24)
    assert abs(shown - 100 * np.array(week["rate"])).max() <= 0.51
    assert not [one for one in figure.axes[0].collections if one.get_hatch()]


def test_hours_without_a_look_are_hatched() -> None:
    week = DoorForecast.fit([MONDAY], [MONDAY + 160 * HOUR], [1]).to_dict()
    hatched = [one for one in week_figure(week).axes[0].collections if one.get_hatch()]
    assert len(hatched) == 8


def test_bins_with_few_looks_are_not_drawn() -> None:
    diagram = Reliability([100, 3] + [0] * 7 + [90], [0.05, 0.15] + [0.0] * 7 + [0.95],
                          [0.0, 1.0] + [0.0] * 7 + [0.9])  # fmt: skip
    figure = week_figure(DoorForecast().to_dict(), [Calibration("1 min", diagram)], "a door")
    line = figure.axes[-1].lines[1]
    assert np.asarray(line.get_xdata()).tolist() == [0.05, 0.95]
