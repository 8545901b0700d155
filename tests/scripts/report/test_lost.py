# pyright: reportMissingImports=false
"""The report's words on whether variants know that they are lost."""

import io
import math

import numpy as np
import pytest
from dynslam_cli.report.lost import (
    ALL,
    lost_summary,
    lost_table,
    lost_terminal,
    reliability_chart,
)
from dynslam_cli.report.summary import Summary
from rich.console import Console

from slam.metrics.lost import auroc, calibration_error, reliability, score_lost
from tests.scripts.results import row

RNG = np.random.default_rng(0)
N = 1200
TIMES = np.arange(N) / 10


def made(variant, seed, wrong, told, fault="slip"):
    """One run with these wrong poses and `Estimate.lost`."""
    truth = np.zeros((N, 3))
    poses = truth + np.column_stack([wrong, 0 * TIMES, 0 * TIMES])
    scores = score_lost(TIMES, poses, truth, told).as_dict()
    return row(variant, seed, 0.1, {"fault": fault, "world": "loop"}) | {"lost": scores, "scans": N}


def spans(*given):
    flags = np.zeros(N, dtype=bool)
    for first, after in given:
        flags[first:after] = True
    return flags


KNOWS = [
    made("knows", 0, spans((300, 500)), 0.9 * spans((320, 500))),
    made("knows", 1, spans((300, 500), (900, N)), 0.9 * spans((380, 480), (960, N))),
    made("knows", 2, spans(), 0.8 * spans((100, 130), (700, 705))),
]


def test_the_scores_of_a_group_by_hand():
    found = lost_summary(KNOWS)
    assert found.runs == 3
    assert found.at_end.value == pytest.approx(100 / 3)
    assert found.wrong == pytest.approx(100 * (200 + 500) / (3 * N))
    assert found.sure == pytest.approx(100 * (20 + 100 + 60) / (3 * N))
    assert found.told.value == pytest.approx(100 / 3)  # after 2 s, 8 s, 6 s
    assert found.notice == pytest.approx(6.0)
    assert found.found == pytest.approx(200 / 3)
    assert found.recover == pytest.approx(20.0)
    hours = (3 * (N - 1) - 200 - 499) / 36000
    assert found.false_alarms == pytest.approx(2 / hours)


def test_a_loss_that_left_no_time_is_not_one_that_was_not_told():
    late = made("a", 0, spans((300, 400), (N - 40, N)), 0.9 * spans((310, 400)))
    assert lost_summary([late]).told.value == 100.0
    early = made("a", 0, spans((300, 400), (N - 60, N)), 0.9 * spans((310, 400)))
    assert lost_summary([early]).told.value == 50.0


def test_probabilities_are_judged_over_all_scans_together():
    told = RNG.random((4, N))
    told[:, 0] = 0.0  # the first pose is right: the others are compared with it
    wrong = RNG.random((4, N)) < told**2
    found = lost_summary([made("a", k, wrong[k], told[k]) for k in range(4)])
    whole, truth = told.ravel(), wrong.ravel()
    assert found.auroc == pytest.approx(auroc(whole, truth), abs=0.005)  # of bins
    assert found.error == pytest.approx(calibration_error(reliability(whole, truth)))
    assert found.brier == pytest.approx(np.mean((whole - truth) ** 2))


def test_a_run_without_a_result_is_lost_at_the_end_and_nothing_else():
    failed = row("knows", 3, None, {"fault": "slip", "world": "loop"})
    with_failed, without = lost_summary([*KNOWS, failed]), lost_summary(KNOWS)
    assert with_failed.at_end.value == 50.0
    assert with_failed[2:] == without[2:]
    nothing = lost_summary([failed])
    assert nothing.at_end.value == 100.0
    assert all(math.isnan(v) for v in (nothing.wrong, nothing.auroc, nothing.error, nothing.brier))


def test_the_table_has_all_conditions_together_and_each():
    others = [made("knows", 0, spans((1, 100)), spans((1, 100)) * 1.0, "lag")]
    summary = Summary([*KNOWS, *others], ["knows"])
    table = lost_table(summary)
    words = [[cell.text for cell in cells[:3]] for cells in table.rows]
    assert words == [[ALL, "knows", "4"], ["fault lag, world loop", "knows", "1"],
                     ["fault slip, world loop", "knows", "3"]]  # fmt: skip
    assert all(len(cells) == len(table.headings) for cells in table.rows)
    ends = dict(zip(table.headings, table.rows[1], strict=True))
    assert ends["time to notice, s"].value == 0.0
    assert ends["AUROC"].text == "1.000"
    assert ends["lost at the end, %"].text.startswith("0 (0 to ")


def test_where_nothing_was_lost_or_told_there_is_no_table():
    quiet = [made("knows", 0, spans(), 0.0 * TIMES)]
    assert not lost_table(Summary(quiet)).rows
    assert not lost_table(Summary([row("a", 0, 0.1)])).rows
    assert reliability_chart(Summary(quiet)) is None
    assert reliability_chart(Summary([row("a", 0, 0.1)])) is None


def test_the_terminal_shows_every_fault_over_all_worlds():
    long = "30 % missing beams"  # as long as any name of the suite
    rows = [*KNOWS, made("knows", 0, spans(), 0.0 * TIMES, long)]
    rows += [made("dynamic-graph", 0, spans((0, N)), 0.0 * TIMES)]
    console = Console(width=80, record=True, file=io.StringIO())
    for table in lost_terminal(rows, ["knows", "dynamic-graph"]):
        console.print(table)
    text = console.export_text()
    lines = [line.split() for line in text.splitlines() if "knows " in line]
    told = lost_summary(KNOWS)
    assert lines[0] == ["slip", "knows", "33", f"{told.sure:.1f}", "33", "6.0", "67", "20.0",
                        f"{told.false_alarms:.1f}"]  # fmt: skip
    assert lines[1] == [*long.split(), "knows", "0", "0.0", "-", "-", "-", "-", "0.0"]
    assert "\u2026" not in text  # nothing is cut
    whole = lost_summary(rows[:-1])
    numbers = f"{whole.wrong:.1f} {whole.auroc:.3f} {whole.error:.3f} {whole.brier:.3f}".split()
    assert lines[2] == ["knows", *numbers]
    assert lost_terminal([row("a", 0, 0.1)], ["a"]) == []


def test_the_diagram_draws_the_variants_that_tell_something():
    told = RNG.random((2, N))
    told[:, 0] = 0.0
    rows = [made("a", k, RNG.random(N) < told[k], told[k]) for k in range(2)]
    rows.append(made("mute", 0, spans((1, 600)), 0.0 * TIMES))
    chart = reliability_chart(Summary(rows, ["a", "mute"]))
    assert chart is not None
    (axes,) = chart.figure.axes
    labels = axes.get_legend_handles_labels()[1]
    assert [label.split()[0] for label in labels] == ["a"]
    x, y = axes.lines[1].get_data()
    assert len(x) == 10
    assert np.abs(np.array(x) - np.array(y)).max() < 0.1
