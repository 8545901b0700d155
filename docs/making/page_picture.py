"""`python -m docs.making.page_picture MAP.html`: the picture of csail's page in docs/map-page.md.

MAP.html is the page that `dynslam map csail.log.gz --page` writes. The picture shows it after some
corrections: a door confirmed, one rejected, one added, and a keep-out zone. Needs Chromium.
"""

from __future__ import annotations

import shutil
import sys
from pathlib import Path
from typing import Any

from playwright.sync_api import sync_playwright

PICTURE = Path(__file__).parents[1] / "map-page.png"
ZONE = (9.4, 2.6), (20.2, 1.6), (19.6, -4.0), (9.0, -3.0)  # m, map of csail: the middle of a block
ADDED = (24.2, 9.0), (24.2, 7.6)  # m: where a passage begins
CONFIRMED, REJECTED = 1, 2  # numbers of doors
SHOWN = 3  # the number of the door whose history is shown


def picture(page: Any) -> None:
    """Correct the page, and take its picture."""
    page.wait_for_selector("body[data-shown]")
    for number, verdict in ((CONFIRMED, "#confirm"), (REJECTED, "#reject")):
        page.click(f"#doors li:nth-child({number}) button")
        page.click(verdict)
    for tool, points in (("zone", ZONE), ("door", ADDED)):
        page.check(f"input[name=tool][value={tool}]")
        for point in points:
            _click(page, point)
        if tool == "zone":
            page.click("#close-zone")
    page.check("input[name=tool][value=look]")
    page.click(f"#doors li:nth-child({SHOWN}) button")
    page.wait_for_timeout(300)
    page.screenshot(path=PICTURE)


def _click(page: Any, point: tuple[float, float]) -> None:
    """Click at a place of the map, m."""
    box = page.locator("#stage").bounding_box()
    x, y = page.evaluate("([x, y]) => view.pixel(x, y)", list(point))
    page.mouse.click(box["x"] + x, box["y"] + y)


if __name__ == "__main__":
    program = shutil.which("chromium") or shutil.which("chromium-browser")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=program, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": 1200, "height": 800})
        page.goto(Path(sys.argv[1]).resolve().as_uri())
        picture(page)
        browser.close()
