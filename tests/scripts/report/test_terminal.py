# pyright: reportMissingImports=false
"""The table at the end of a bench, in a terminal of 80 columns."""

import io

from dynslam_cli.report.terminal import results_terminal
from rich.console import Console

from ..results import row, rows


def printed(found, order) -> list[str]:
    file = io.StringIO()
    Console(file=file, width=80).print(results_terminal(found, order))
    return file.getvalue().splitlines()


def line(lines: list[str], variant: str) -> list[str]:
    return next(one.split() for one in lines if one.split()[:1] == [variant])


def test_it_has_medians_intervals_and_marks_of_what_is_better_or_worse():
    lines = printed(rows(), ["a", "b", "c"])
    assert line(lines, "b")[1:3] == ["12", "0"]
    assert line(lines, "b")[5] == "-"  # worse than a
    assert line(lines, "c")[5].startswith("0.")  # no mark: F1 follows the interval
    assert any("doors moving" in one for one in lines)
    assert max(map(len, lines)) <= 80


def test_a_long_condition_and_a_long_name_are_folded_and_no_number_is_cut():
    condition = {"plane": "laser", "laser range, m": 2.5, "flips of a door a minute": 24.0}
    name = "outside:a-system-with-quite-a-long-name-of-its-own"
    found = [row(name, seed, 12.3456 + seed, condition) for seed in range(3)]
    found += [row("lost", seed, None, condition) for seed in range(3)]
    lines = printed(found, [name, "lost"])
    assert max(map(len, lines)) <= 80
    assert any("13346 (12346-14346)" in one for one in lines)
    assert line(lines, "lost")[3] == "lost"
    whole = "".join(one.split()[0] for one in lines)
    assert name in whole


def test_very_many_conditions_are_taken_together():
    conditions = tuple({"k": float(k)} for k in range(30))
    lines = printed(rows(2, conditions), ["a", "b", "c"])
    assert any("all 30 conditions" in one for one in lines)
    assert line(lines, "b")[1] == "60"
    assert len(lines) < 15
