"""The pages agree with the code: cards, names of variants, citation, pictures."""

import re
import tomllib

import pytest

import slam
from docs.making import cards
from slam.algorithms.ceilings import CEILINGS
from slam.algorithms.variants import BUILDERS, MAPS
from tests.docs.pages import DOCS, PAGES, ROOT

LARGEST = 100_000  # bytes of a picture of a world
LARGEST_FILM = 300_000


def test_the_cards_are_those_of_the_classes():
    assert cards.PAGE.read_text(encoding="utf-8") == cards.page(), "run: make docs"


def test_each_environment_has_a_picture():
    assert len(cards.ids()) == 9
    for name in cards.ids():
        assert (DOCS / "worlds" / f"{name}.png").stat().st_size < LARGEST


def test_each_environment_has_a_film():
    page = cards.PAGE.read_text(encoding="utf-8")
    for name in cards.ids():
        film = DOCS / "worlds" / f"{name}.gif"
        assert 10_000 < film.stat().st_size <= LARGEST_FILM, name
        assert f"](worlds/{name}.gif)" in page, name


def test_each_picture_is_there_and_shown():
    shown = {
        (page.parent / target).resolve()
        for page in PAGES
        for target in re.findall(r"!\[[^\]]*\]\(([^)]+)\)", page.read_text(encoding="utf-8"))
    }
    there = {path.resolve() for path in DOCS.rglob("*") if path.suffix in (".png", ".gif")}
    assert shown == there


def test_each_variant_is_on_its_page_and_no_other():
    page = (DOCS / "variants.md").read_text(encoding="utf-8")
    table = page.split("## All names")[1].split("## A variant of your own")[0]
    named = set(re.findall(r"`([\w/-]+)`", table))
    assert named == set(BUILDERS) | set(CEILINGS)
    assert set(BUILDERS) <= set(slam.variants())


@pytest.mark.parametrize("name", ["variants.md", "theory.md"])
def test_each_map_is_explained(name):
    page = (DOCS / name).read_text(encoding="utf-8")
    assert set(re.findall(r"^\| `(\w+)` \|", page, re.MULTILINE)) >= set(MAPS)


def test_the_citation_is_that_of_the_file():
    page = (DOCS / "cite.md").read_text(encoding="utf-8").replace("{SLAM}", "SLAM")
    file = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    version = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    for title in re.findall(r'^ *title: "(.*)"$', file, re.MULTILINE):
        assert title in page
    assert f"version: {version}" in file
    assert f"version = {{{version}}}" in page


def test_two_columns_become_a_list_and_running_text_stays():
    pytest.importorskip("griffe", reason="the extra [docs] is not installed")
    from docs.making.columns import listed

    text = (
        "Of it.\n\nrange, angle  m, rad\ntime          s, when\n              taken\n\nAll  told."
    )
    assert (
        listed(text)
        == "Of it.\n\n- `range`, `angle`: m, rad\n- `time`: s, when taken\n\nAll  told."
    )
