"""The site is built strictly: a link or an anchor that leads nowhere fails."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.browser import chromium
from tests.docs.pages import DOCS, PAGES, ROOT

pytest.importorskip("mkdocs", reason="the extra [docs] is not installed")


@pytest.fixture(scope="module")
def site(tmp_path_factory) -> Path:
    """The built site."""
    out = tmp_path_factory.mktemp("site")
    build = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(out)],
        cwd=ROOT,
        env=os.environ | {"NO_MKDOCS_2_WARNING": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert build.returncode == 0, build.stderr
    assert "WARNING" not in build.stderr, build.stderr
    return out


def test_every_page_is_in_the_menu(site):
    start = (site / "index.html").read_text(encoding="utf-8")
    for page in PAGES:
        if DOCS in page.parents:
            made = page.relative_to(DOCS).with_suffix(".html").as_posix()
            assert (site / made).exists()
            assert f'href="{made}"' in start or made == "index.html", made


def test_from_a_disk_the_menu_is_seen_at_1200_pixels_and_the_search_finds(site):
    with chromium() as browser:
        page = browser.new_page(viewport={"width": 1200, "height": 800})
        page.goto((site / "api" / "slam.html").as_uri())
        menu = page.locator(".md-sidebar--primary").bounding_box()
        assert menu["x"] >= 0
        assert menu["width"] > 200
        search = page.locator("input.md-search__input")
        results = page.locator(".md-search-result__link")
        for _ in range(50):  # what is typed before the page's script runs is not searched
            search.fill("")
            search.press_sequentially("ghosts")
            page.wait_for_timeout(2000)
            if results.count():
                break
        found = results.evaluate_all("all => all.map(a => a.href)")
        assert any(link.startswith((site / "ghosts.html").as_uri()) for link in found)


def test_nothing_is_asked_of_the_network(site):
    asked = r'<(?:script|img|iframe)[^>]*\bsrc="(?:https?:)?//|<link[^>]*\bhref="(?:https?:)?//'
    for page in site.rglob("*.html"):
        assert not re.search(asked, page.read_text(encoding="utf-8")), page


def test_formulas_are_mathml_and_complete(site):
    page = (site / "theory.html").read_text(encoding="utf-8")
    formulas = re.findall(r"<math.*?</math>", page, re.DOTALL)
    assert len(formulas) == (DOCS / "theory.md").read_text(encoding="utf-8").count("```math")
    assert not any("\\" in formula for formula in formulas)  # a command that was not understood


def test_columns_of_docstrings_become_lists(site):
    page = (site / "api" / "slam.html").read_text(encoding="utf-8")
    assert re.search(r"<li><code>covariance</code>: \(3, 3\) of x, y in m", page)


def test_snippets_are_put_in(site):
    for name in ("changelog", "cite", "map-a-log", "train-an-explorer"):
        page = (site / f"{name}.html").read_text(encoding="utf-8")
        assert "--8&lt;--" not in page
        assert "--8<--" not in page
    assert "0.1.0" in (site / "changelog.html").read_text(encoding="utf-8")


def test_what_makes_the_site_is_not_in_it(site):
    assert not list(site.rglob("*.py"))
