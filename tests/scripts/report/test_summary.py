# pyright: reportMissingImports=false
import math
import re

import markupsafe
import numpy as np
import pytest
from dynslam_cli.report.charts import charts, shown
from dynslam_cli.report.phase import phase_diagrams
from dynslam_cli.report.scores import ATE, F1, RELATIONS, main_score, present
from dynslam_cli.report.summary import Summary
from dynslam_cli.report.tables import Cell, Table, latex, markdown, tables
from dynslam_cli.report.write import write_report
from dynslam_cli.trials.results import Condition
from scipy import stats

from ..results import row, rows


def test_variants_keep_the_order_in_which_they_were_named_and_rows_lose_theirs():
    given = rows()
    summary = Summary(given[::-1], ["b", "a"])
    assert summary.variants == ["b", "a", "c"]
    again = Summary(given, ["b", "a"])
    assert [r["run"] for r in again.rows] == [r["run"] for r in summary.rows]


def test_conditions_are_sorted_by_their_numbers():
    given = [row("a", 0, 0.1, {"x": x}) for x in (10.0, 2.0, 1.5)]
    assert [str(c) for c in Summary(given).conditions] == ["x 1.5", "x 2.0", "x 10.0"]


def test_a_difference_that_is_there_is_found_and_noise_is_not():
    found = {(c.variant, c.score.key): c for c in Summary(rows(), ["a"]).comparisons()}
    worse = found["b", "ate"]
    assert worse.found.difference.value == pytest.approx(3.0)
    assert (worse.verdict, worse.pairs, worse.baseline) == ("worse", 12, "a")
    assert found["b", "f1_5cm"].verdict == "worse"
    assert found["c", "ate"].verdict == ""
    a, b = (Summary(rows()).groups[Condition((("doors", "moving"),)), v].values(ATE) for v in "ab")
    expected = stats.wilcoxon(np.subtract(b, a))
    assert worse.found.p == pytest.approx(expected.pvalue)  # pyright: ignore[reportAttributeAccessIssue]


def test_q_corrects_for_all_comparisons_of_the_page():
    found = Summary(rows(), ["a"]).comparisons()
    expected = stats.false_discovery_control([c.found.p for c in found])
    assert [c.q for c in found] == pytest.approx(expected.tolist())
    assert all(c.q >= c.found.p for c in found)


def test_a_run_without_a_result_counts_as_the_worst():
    given = [*rows(), *(row("d", seed, None if seed < 8 else 0.001) for seed in range(12))]
    summary = Summary(given, ["a"])
    group = summary.groups[Condition((("doors", "moving"),)), "d"]
    assert group.median(ATE).value == math.inf
    assert group.values(F1)[:8] == [0.0] * 8
    assert group.failed().value == pytest.approx(100 * 8 / 12)
    means, _ = summary.ranks()[0]
    assert means[3].value == (8 * 4 + 4 * 1) / 12
    table = next(t for t in tables(summary) if t.name == "errors")
    assert len(table.rows) == 8
    assert table.rows[0][-1].text == "it broke"


def test_where_most_pairs_are_equal_there_is_no_verdict():
    given = [row("a", s, 0.02) for s in range(22)]
    given += [row("b", s, 0.02 if s < 13 else 0.01) for s in range(22)]
    found = {c.score.key: c for c in Summary(given, ["a"]).comparisons()}
    assert found["ate"].found.difference.value == 0.0
    assert found["ate"].q < 0.05
    assert found["ate"].verdict == ""  # the nine that differ are all better


def test_of_a_log_without_the_truth_a_run_without_a_result_is_one_of_all():
    good = [{k: v for k, v in row("a", s, 0.02).items() if k != "failed"} for s in range(9)]
    (group,) = Summary([*good, row("a", 9, None)]).groups.values()
    assert group.failed().value == pytest.approx(10)
    (group,) = Summary(good).groups.values()
    assert math.isnan(group.failed().value)


def test_conditions_where_a_variant_is_always_lost_are_shown():
    given = []
    for x in range(10):
        given += [row("a", s, 0.01, {"x": float(x)}) for s in range(3)]
        given += [row("b", s, None if x == 3 else 0.01 + x, {"x": float(x)}) for s in range(3)]
    assert 3 in [dict(c.factors)["x"] for c in shown(Summary(given))]


def test_ranks_are_of_episodes_that_every_variant_was_run_on():
    given = rows()
    (means, p), episodes = Summary(given).ranks()
    assert episodes == 12
    assert means[1].value > means[0].value
    assert p < 0.01
    assert Summary(given[:-1]).ranks()[1] == 11  # one run of c is missing
    assert Summary([row("a", 0, 0.1)]).ranks() is None


def test_the_main_score_is_the_first_that_is_known():
    assert main_score(rows()) is ATE
    log = {"error": None, "condition": [], "translation_mean": 0.04}
    assert main_score([log]) is RELATIONS
    assert main_score([{"error": None}]) is None
    assert present((ATE, F1), [log]) == []


def test_tables_hold_every_group_and_every_pair():
    laws = ({"doors": "static"}, {"doors": "moving"})
    summary = Summary(rows(conditions=laws), ["a"])
    medians, paired = tables(summary)
    assert len(medians.rows) == 2 * 3
    assert len(paired.rows) == 2 * 2 * 3
    assert all(len(r) == len(medians.headings) for r in medians.rows)
    ate = medians.headings.index("ATE, mm")
    values = np.array([r["ate"] for r in summary.rows if r["variant"] == "b"][:12])
    assert medians.rows[1][ate].value == pytest.approx(1e3 * np.median(values))


def test_markdown_has_a_line_a_row():
    table = tables(Summary(rows(), ["a"]))[0]
    lines = markdown(table).splitlines()
    assert len(lines) == 2 + len(table.rows)
    assert {line.count("|") for line in lines} == {len(table.headings) + 1}


def test_latex_is_escaped():
    given = [row("a_b", 0, 0.1, {"share, %": 50.0})]
    text = latex(tables(Summary(given))[0])
    assert r"a\_b" in text
    assert r"share, \% 50.0" in text
    assert not re.search(r"(?<!\\)[_%](?!.*MB)", text.split("\\midrule")[1])
    assert text.count(r"\\") == 2


def test_what_happened_to_a_run_stays_on_one_line_of_a_table_and_is_no_tag():
    table = Table("t", "", "", ["p"], [[Cell("< 0.001 |\n\n<b>", 0.0)]])
    assert markdown(table).splitlines()[-1] == "| \\< 0.001 \\| \\<b> |"
    assert r"\textless{} 0.001 \textbar{} \textless{}b\textgreater{} \\" in latex(table)


NAMES = ["<script>alert(1)</script>", r"$\no$", "a$b$%&#_", "\"'", "a|b"]


def test_any_name_of_a_variant_or_a_condition_is_told_as_it_is(tmp_path):
    given = []
    for name in NAMES:
        case = {"case": name}
        given += [row(v, s, 0.02 + s / 1e3, case) for v in ("a", name) for s in range(3)]
        given.append(row(name, 3, None, case))
    for _ in write_report(given, tmp_path, ["a"]):
        pass
    text = (tmp_path / "report.html").read_text()
    for name in NAMES:
        assert str(markupsafe.escape(name)) in text
    assert "<script>alert" not in text


def test_every_chart_is_drawn_from_full_results():
    names = [chart.name for chart in charts(Summary(rows(), ["a"]))]
    assert names == ["ranks", "errors", "error-over-time", "calibration", "accuracy-speed",
                     "memory-time", "bound"]  # fmt: skip


@pytest.mark.parametrize(
    "given",
    [
        [row("a", 0, 0.1)],
        [row("a", 0, None)],
        [row("a", 0, None), row("b", 0, 0.1)],
        [row("a", k, 0.0) for k in range(3)],
        [row("a", 0, 0.1), row("a", 1, None)],  # the second has no duration
        [{**row("a", 0, None), "error": None, "failed": None}],  # a log that nothing is known of
    ],
)
def test_what_can_be_drawn_is_drawn_from_less(given):
    summary = Summary(given)
    for chart in charts(summary):
        chart.figure.canvas.draw()
    tables(summary)


def test_of_many_conditions_those_are_shown_where_variants_differ_most():
    given = []
    for x in range(10):
        given += [row("a", s, 0.01, {"x": float(x)}) for s in range(3)]
        given += [row("b", s, 0.01 * (1 + x), {"x": float(x)}) for s in range(3)]
    assert [dict(c.factors)["x"] for c in shown(Summary(given))] == [4, 5, 6, 7, 8, 9]


def plane(better: str = "a") -> list:
    given = []
    for x in (1.0, 2.0):
        for y in (10.0, 20.0, 30.0):
            condition = {"plane": "p", "speed": x, "range": y}
            for seed in range(8):
                given.append(row("a", seed, 0.02 + 0.001 * seed, condition))
                bonus = 0.01 if (x, y) == (2.0, 30.0) else -0.01
                given.append(row("b", seed, 0.02 + 0.001 * seed - bonus, condition))
    return given


def test_a_phase_diagram_names_the_best_in_every_cell():
    (chart,) = phase_diagrams(Summary(plane(), ["a"]))
    panels = chart.figure.axes
    assert [axes.get_title() for axes in panels] == ["a", "b", "best median"]
    best = {tuple(map(int, t.get_position())): t.get_text() for t in panels[2].texts}
    assert best.pop((1, 2)) == "b*"
    assert set(best.values()) == {"a*"}
    assert len(best) == 5
    told = {tuple(map(int, t.get_position())): t.get_text() for t in panels[1].texts}
    assert told[1, 2] == "13.5"


def test_a_phase_diagram_tells_the_share_of_lost_runs():
    given = [{**r, "failed": r["variant"] == "b" and r["seed"] < 4} for r in plane()]
    (chart,) = phase_diagrams(Summary(given, ["a"]))
    assert all(t.get_text().endswith("\n50 %") for t in chart.figure.axes[1].texts)


def test_where_every_run_is_lost_no_variant_is_the_best():
    given = [row(r["variant"], r["seed"], None, {n: r[n] for n in r["condition"]})
             if r["speed"] == 1.0 else r for r in plane()]  # fmt: skip
    (chart,) = phase_diagrams(Summary(given, ["a"]))
    best = {tuple(map(int, t.get_position())) for t in chart.figure.axes[2].texts}
    assert best == {(1, 0), (1, 1), (1, 2)}
    chart.figure.canvas.draw()


def test_without_planes_there_is_no_phase_diagram():
    assert list(phase_diagrams(Summary(rows()))) == []
