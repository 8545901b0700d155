# pyright: reportMissingImports=false
"""Progress where standard error is no terminal: lines with a rate and the time left."""

import time

import pytest
from dynslam_cli.console import progress
from dynslam_cli.console.progress import duration, progress_bar


@pytest.fixture
def hurried(monkeypatch):
    monkeypatch.setattr(progress, "LINE_EVERY", 0.1)


def test_a_line_now_and_then_tells_count_rate_and_time_left(hurried, capfd):
    with progress_bar() as bar:
        for _ in bar.track(range(30), 300, description="300 runs"):
            time.sleep(0.02)
    lines = capfd.readouterr().err.splitlines()
    assert 2 <= len(lines) <= 10
    assert lines[-1].startswith("300 runs: ")
    done = int(lines[-1].split()[2])
    assert 5 <= done <= 30
    assert " of 300, " in lines[-1]
    rate = float(lines[-1].split(", ")[1].removesuffix(" a second"))
    assert 15 < rate <= 55
    assert lines[-1].endswith(" s left")


def test_where_an_item_takes_longer_than_rates_are_measured_over_the_rate_is_that_of_all(
    hurried, monkeypatch, capfd
):
    """`28 runs: 25 of 28` stood for half an hour, while one program ran."""
    monkeypatch.setattr(progress, "RATE_OVER", 0.1)
    with progress_bar() as bar:
        task = bar.add_task("28 runs", total=28)
        bar.update(task, advance=10)
        time.sleep(0.3)
        bar.update(task, advance=10)
        time.sleep(0.25)
    last = capfd.readouterr().err.splitlines()[-1]
    assert last.startswith("28 runs: 20 of 28, ")
    assert " a second, " in last
    assert last.endswith(" s left")


def test_of_what_has_no_end_the_time_is_told(hurried, capfd):
    with progress_bar() as bar:
        bar.add_task("report", total=None)
        time.sleep(0.25)
    assert capfd.readouterr().err.splitlines()[0] == "report: 0 s"


def test_nothing_is_told_of_what_has_not_begun(hurried, capfd):
    with progress_bar() as bar:
        bar.add_task("training", total=10, start=False)
        time.sleep(0.25)
    assert capfd.readouterr().err == ""


def test_nothing_is_written_of_what_is_done_soon_or_after_the_end(hurried, capfd):
    with progress_bar() as bar:
        for _ in bar.track(range(3), description="short"):
            pass
    time.sleep(0.3)
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize(
    ("seconds", "told"), [(4.4, "4 s"), (61, "1 min"), (3599, "1 h 0 min"), (12000, "3 h 20 min")]
)
def test_times_are_told_in_units_that_people_use(seconds, told):
    assert duration(seconds) == told
