# pyright: reportMissingImports=false
"""The report in a real browser: Debian's Chromium, headless."""

import csv
import shutil
from pathlib import Path

import pytest
from dynslam_cli import main

from slam.benchmark.results import read
from tests.browser import watched
from tests.one_process import made_once

ORDER = ("static-ml", "dynamic-ml", "odometry")


@pytest.fixture(scope="module")
def report(small_results, tmp_path_factory) -> Path:
    """Of the small bench with one more variant."""

    def bench(out: Path) -> None:
        shutil.copytree(small_results, out, dirs_exist_ok=True)
        arguments = ["paper", "--seeds", "2", "--variants", ",".join(ORDER), "--jobs", "1"]
        assert main.status(["bench", *arguments, "--resume", "--out", str(out)]) == 0

    return made_once(tmp_path_factory, "bench", bench) / "report.html"


@pytest.fixture
def page(browser, report):
    """The page as it was opened."""
    with watched(browser, report) as opened:
        yield opened


def column(page, number: int) -> list[str]:
    return page.locator(f"#table-summary tbody tr:visible td:nth-child({number})").all_inner_texts()


def test_a_click_sorts_and_a_second_one_turns_the_order(page):
    heads = page.locator("#table-summary th")
    ate = heads.all_inner_texts().index("ATE, mm")
    values = [float(text.split()[0]) for text in column(page, ate + 1)]
    page.click(f"#table-summary th:nth-child({ate + 1}) button")
    assert [float(t.split()[0]) for t in column(page, ate + 1)] == sorted(values)
    assert heads.nth(ate).get_attribute("aria-sort") == "ascending"
    page.click(f"#table-summary th:nth-child({ate + 1}) button")
    assert [float(t.split()[0]) for t in column(page, ate + 1)] == sorted(values)[::-1]
    page.click("#table-summary th:nth-child(2) button")
    assert column(page, 2) == sorted(column(page, 2))
    assert heads.nth(ate).get_attribute("aria-sort") is None


def test_words_filter_the_rows(page):
    page.fill("input[data-table=table-summary]", "moving dynamic")
    assert column(page, 2) == ["dynamic-ml"]
    assert page.locator("output[for=table-summary]").inner_text() == "1 of 6 rows"
    page.fill("input[data-table=table-summary]", "")
    assert len(column(page, 2)) == 6


def test_every_link_leads_to_a_heading_and_every_figure_is_there(page):
    for link in page.locator("nav a").all():
        target = link.get_attribute("href")
        assert page.locator(target).count() == 1, target
    page.evaluate(
        "document.querySelectorAll('img').forEach((image) => { image.loading = 'eager' })"
    )
    page.wait_for_function("[...document.images].every((image) => image.complete)")
    sizes = page.evaluate("[...document.images].map((image) => image.naturalWidth)")
    assert len(sizes) >= 9
    assert min(sizes) > 300
    assert all(image.get_attribute("alt") for image in page.locator("img").all())


def painted(page) -> list[str]:
    return page.evaluate("[...document.querySelectorAll('canvas')].map((c) => c.toDataURL())")


def test_the_replay_follows_the_arrow_keys(page):
    page.wait_for_function("document.querySelectorAll('canvas[aria-label]').length === 3")
    first = painted(page)
    page.focus("#moment")
    for _ in range(10):
        page.keyboard.press("ArrowRight")
    page.wait_for_timeout(300)
    assert page.input_value("#moment") == "10"
    assert page.inner_text("#scan").startswith("105 of ")
    assert all(a != b for a, b in zip(first, painted(page), strict=True))
    off = [float(t.split(": ")[1].split()[0]) for t in page.locator("figcaption").all_inner_texts()]
    assert max(off[:2]) < 60
    assert off[2] > 500  # odometry
    page.keyboard.press("Home")
    page.wait_for_timeout(300)
    assert painted(page) == first


def test_the_replay_plays_to_its_end_and_stops(page):
    page.focus("#moment")
    page.keyboard.press("End")
    for _ in range(3):
        page.keyboard.press("ArrowLeft")
    page.click("#play")
    assert page.inner_text("#play") == "Pause"
    page.wait_for_function("document.getElementById('play').textContent === 'Play'", timeout=5000)
    assert page.input_value("#moment") == page.get_attribute("#moment", "max")


def test_another_episode_can_be_chosen(page):
    titles = page.locator("#episode option").all_inner_texts()
    assert titles == ["doors moving, seed 5000", "doors static, seed 5000"]
    page.fill("#moment", "30")  # at the beginning a pair of episodes looks alike
    page.wait_for_timeout(300)
    before = painted(page)
    page.select_option("#episode", "1")
    assert page.input_value("#moment") == "0"
    page.fill("#moment", "30")
    page.wait_for_timeout(300)
    assert painted(page)[0] != before[0]


def test_the_keyboard_alone_reaches_everything(page):
    reached = set()
    for _ in range(80):
        page.keyboard.press("Tab")
        reached.add(page.evaluate("document.activeElement.id || document.activeElement.tagName"))
    assert {"A", "INPUT", "BUTTON", "DIV", "episode", "play", "moment"} <= reached
    page.locator("#table-summary th button").nth(1).focus()
    page.keyboard.press("Enter")
    assert page.locator("#table-summary th").nth(1).get_attribute("aria-sort") == "ascending"


@pytest.mark.parametrize("width", [320, 390, 768])
def test_it_fits_the_width_of_a_phone(page, width):
    page.set_viewport_size({"width": width, "height": 800})
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    canvas = page.locator("canvas").first.bounding_box()
    assert canvas["width"] <= width


def test_the_summary_shows_its_main_columns_at_1200_pixels(page):
    """F1, the doors and the time stood right of nine others, out of sight."""
    page.set_viewport_size({"width": 1200, "height": 800})
    edges = page.locator("#table-summary th").evaluate_all(
        "all => all.map(one => [one.innerText, one.getBoundingClientRect().right])"
    )
    seen = [name for name, right in edges if right <= 1200]
    assert seen[2:8] == ["runs", "lost, %", "ATE, mm", "F1", "Brier of doors",
                         "time per matched scan, ms"]  # fmt: skip


def test_a_figure_is_there_as_png_and_svg_and_a_table_as_markdown_and_latex(report):
    out = report.parent
    names = {path.stem for path in (out / "figures").iterdir()}
    assert {"ranks", "errors", "error-over-time", "calibration", "accuracy-speed", "memory-time",
            "bound", "maps-1", "maps-2"} <= names  # fmt: skip
    for name in names:
        assert (out / "figures" / f"{name}.png").stat().st_size > 5_000
        assert b"<svg" in (out / "figures" / f"{name}.svg").read_bytes()[:2000]
    assert {path.name for path in (out / "tables").iterdir()} == {
        f"{name}.{kind}" for name in ("summary", "paired", "lost") for kind in ("md", "tex")
    }
    assert len(read(out / "results.jsonl")) == 12


def test_a_csv_has_one_line_a_run(report):
    with (report.parent / "results.csv").open() as file:
        lines = list(csv.DictReader(file))
    by_run = {row["run"]: row for row in read(report.parent / "results.jsonl")}
    assert len(lines) == len(by_run) == 12
    assert {line["run"] for line in lines} == by_run.keys()
    assert all(float(line["ate"]) == by_run[line["run"]]["ate"] for line in lines)


def test_the_same_results_give_the_same_page(report, tmp_path):
    from dynslam_cli.report.write import write_report

    before = report.read_bytes()
    out = shutil.copytree(report.parent, tmp_path / "again")
    (out / "report.html").unlink()
    for _ in write_report(read(out / "results.jsonl")[::-1], out, ORDER):
        pass
    assert (out / "report.html").read_bytes() == before
