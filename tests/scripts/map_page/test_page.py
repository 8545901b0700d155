# pyright: reportMissingImports=false
"""The page of a map in a real browser."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from dynslam_cli.map_page.write import write_page
from PIL import Image

import slam
from dynslam_env import FromMap
from slam.benchmark.run import run
from slam.episode import Episode
from slam.io.layers import write_doors
from slam.io.ros_map import read_ros_map, write_filter_mask, write_ros_map
from slam.layers import layers
from slam.layers.classification import KEPT, KEPT_REASONS, SEEN_IN_PART, SEEN_ONCE, STATIC
from slam.layers.doors import MappedDoor
from slam.layers.filter_masks import CLOSED, keepout_mask
from tests.browser import watched

SURE = MappedDoor(np.array([[1.0, 0.5], [1.0, -0.5]]), 0.4, 2, 9.0, 1.0, 8.0, 21, 34, 0.95, 1, 1)
PERHAPS = MappedDoor(np.array([[2.0, 0.4], [2.0, -0.4]]), 0.6, 1, 5.0, 2.0, 6.0, 7, 5, 0.62)
LOST = (20, 30)  # first scan, and the one after the last
ZONE = [(0.5, -0.3), (1.5, -0.3), (1.5, 0.5)]  # 0.4 m2


@pytest.fixture(scope="module")
def folder(tmp_path_factory, short_episode: Episode) -> Path:
    """A map with two doors, its page beside it."""
    out = tmp_path_factory.mktemp("page")
    done = run(slam.make("dynamic-ml"), short_episode)
    lost = np.zeros(len(done.poses))
    lost[slice(*LOST)] = 0.9
    done = replace(done, lost=lost)
    found = layers(short_episode.scans, done.poses, believed=done.grid)
    found = replace(found, doors=(SURE, PERHAPS))
    write_ros_map(found.static_map(), out / "map.yaml")
    write_filter_mask(keepout_mask(found, KEPT_REASONS), found.spec, out / "keepout.yaml")
    write_doors(found, out / "doors.geojson")
    for name in ("map.html", "again.html"):
        write_page(out / name, "a drive", short_episode, done, found)
    write_page(out / "localised.html", "a <drive> & more", short_episode, done, None)
    return out


@pytest.fixture
def page(browser, folder: Path):
    with watched(browser, folder / "map.html", 1200) as opened:
        opened.wait_for_selector("body[data-shown]")
        yield opened


def painted(page) -> str:
    page.wait_for_timeout(100)
    return page.evaluate("document.getElementById('stage').toDataURL()")


def count(page, test: str) -> int:
    """Pixels of the map for which a test of r, g, b holds."""
    page.wait_for_timeout(100)
    return page.evaluate(
        """(test) => {
          const canvas = document.getElementById('stage');
          const { data } = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height);
          const holds = new Function('r', 'g', 'b', `return ${test}`);
          let n = 0;
          for (let k = 0; k < data.length; k += 4) n += holds(data[k], data[k + 1], data[k + 2]);
          return n;
        }""",
        test,
    )


BLACK, VIOLET, RED = "r + g + b === 0", "r === 153 && g === 0 && b === 255", "r > 180 && b < 90"


def at(page, x: float, y: float) -> tuple[float, float]:
    """Where a place of the world, m, is on the screen."""
    box = page.locator("#stage").bounding_box()
    px, py = page.evaluate("([x, y]) => view.pixel(x, y)", [x, y])
    return box["x"] + px, box["y"] + py


def click(page, x: float, y: float) -> None:
    page.mouse.click(*at(page, x, y))


def saved(page, name: str, folder: Path, count: int) -> list[Path]:
    got: list = []
    page.on("download", lambda download: got.append(download))
    page.click(name)
    while len(got) < count:
        page.wait_for_timeout(20)
    for one in got:
        one.save_as(folder / one.suggested_filename)
    return [folder / one.suggested_filename for one in got]


def test_walls_are_dark_at_any_zoom(page) -> None:
    for _ in range(3):
        page.click("#further")
    small = count(page, BLACK)
    page.click("#all")
    whole = count(page, BLACK)
    for _ in range(4):
        page.click("#closer")
    assert small > 200  # 1 pixel or more of each wall, though cells are a fraction of one
    assert whole > small
    assert count(page, BLACK) > 500


def test_the_mouse_moves_and_zooms_about_its_place(page) -> None:
    x, y = at(page, 1.5, 0.2)
    page.mouse.move(x, y)
    page.mouse.wheel(0, -500)
    page.wait_for_timeout(100)
    assert at(page, 1.5, 0.2) == pytest.approx((x, y), abs=1)
    page.mouse.down()
    page.mouse.move(x + 50, y + 30, steps=4)
    page.mouse.up()
    assert at(page, 1.5, 0.2) == pytest.approx((x + 50, y + 30), abs=1)
    assert page.inner_text("#where") == "(1.50, 0.20)"


def test_layers_are_switched_with_their_legends(page) -> None:
    pictures, legends = set(), set()
    for name in ("map", "layers", "belief"):
        page.check(f"input[value={name}]")
        page.wait_for_selector(f"body[data-shown={name}]")
        pictures.add(painted(page))
        legends.add(page.inner_text("#legend"))
    assert len(pictures) == len(legends) == 3
    page.check("#show-reasons")
    page.wait_for_selector("body[data-shown=reasons]")
    assert "left out: it was seen to go" in page.inner_text("#legend")
    page.uncheck("#show-reasons")
    before = painted(page)
    page.uncheck("#show-path")
    assert painted(page) != before


def test_the_drive_is_played_and_lost_stretches_are_marked(page) -> None:
    assert count(page, VIOLET) > 30
    assert page.locator("#stretches button").count() == 1
    page.click("#stretches button")
    assert page.input_value("#moment") == str(LOST[0])
    assert "lost: 90 %" in page.inner_text("#time")
    before = painted(page)
    page.fill("#moment", "76")
    page.click("#play")
    assert page.inner_text("#play") == "Pause"
    page.wait_for_function("document.getElementById('play').textContent === 'Play'")
    assert page.input_value("#moment") == page.get_attribute("#moment", "max") == "79"
    assert painted(page) != before


def test_a_click_on_a_door_tells_its_probability_and_history(page) -> None:
    click(page, 1.0, 0.0)
    assert page.inner_text("#door-name") == "Door 1"
    told = page.inner_text("#facts")
    assert "95 %: door" in told
    assert "21 saw it open, 34 closed" in told
    click(page, 2.0, 0.1)
    assert "62 %: perhaps a door" in page.inner_text("#facts")
    assert page.locator("#bar button").count() > 0
    page.fill("#moment", "0")
    last = page.locator("#bar button").last
    begin = last.get_attribute("aria-label").split()[2]
    last.focus()
    page.keyboard.press("Enter")
    assert page.inner_text("#time").startswith(begin.split(".")[0]) or begin == "0:00.0"
    click(page, 0.4, 0.4)  # no door there
    assert page.locator("#door").is_hidden()


def test_a_finger_chooses_a_door_and_moves_the_map(browser, folder: Path) -> None:
    context = browser.new_context(viewport={"width": 390, "height": 800}, has_touch=True)
    page = context.new_page()
    page.goto((folder / "map.html").as_uri())
    page.wait_for_selector("body[data-shown]")
    page.touchscreen.tap(*at(page, 1.0, 0.0))
    assert page.inner_text("#door-name") == "Door 1"
    context.close()


def test_a_keep_out_zone_becomes_a_mask_for_nav2(page, folder: Path, tmp_path: Path) -> None:
    page.check("input[value=zone]")
    for corner in ZONE:
        click(page, *corner)
    page.click("#close-zone")
    assert "3 corners, 0.4 m²" in page.inner_text("#zones")
    assert count(page, RED) > 500
    files = {path.name for path in saved(page, "#save-zones", tmp_path, 2)}
    assert files == {"keepout.yaml", "keepout.pgm"}
    fields = yaml.safe_load((tmp_path / "keepout.yaml").read_text())
    same = yaml.safe_load((folder / "map.yaml").read_text())
    assert fields == {**same, "image": "keepout.pgm"}
    mask = read_ros_map(tmp_path / "keepout.yaml")
    assert mask.spec == read_ros_map(folder / "map.yaml").spec
    assert mask.observed.all()
    with Image.open(tmp_path / "keepout.pgm") as image:  # another reader of the format
        assert (image.format, image.mode, image.size) == ("PPM", "L", mask.spec.shape[::-1])
        assert set(np.unique(np.asarray(image))) == {0, 254}
    closed = read_ros_map(folder / "keepout.yaml").occupied == 1  # by the run
    x, y = mask.spec.centres(np.argwhere((mask.occupied == 1) & ~closed)).T
    assert len(x) * mask.spec.resolution**2 == pytest.approx(0.4, abs=0.03)
    assert x.min() > 0.45
    assert x.max() < 1.55
    assert (y < 0.55 + 0.8 * (x - 1.5)).all()  # the side from the first corner to the last
    page.click("#zones button")
    assert page.inner_text("#zones") == "none drawn"


def test_a_saved_mask_also_has_the_cells_that_the_run_closed(
    browser, folder: Path, tmp_path: Path, short_episode: Episode
) -> None:
    done = run(slam.make("dynamic-ml"), short_episode)
    found = layers(short_episode.scans, done.poses, believed=done.grid)
    reason = found.reason.copy()
    kept = np.argwhere(found.kind == STATIC)[::7]  # as if of glass
    kind = found.kind.copy()
    kind[tuple(kept.T)], reason[tuple(kept.T)] = KEPT, SEEN_IN_PART
    found = replace(found, kind=kind, reason=reason)
    ours = keepout_mask(found, KEPT_REASONS) == CLOSED
    assert 50 < ours.sum() < ours.size / 2
    for name, keep, closed in (("all", KEPT_REASONS, ours), ("few", (SEEN_ONCE,), ours & False)):
        path = tmp_path / f"{name}.html"
        write_page(path, name, short_episode, done, found, keep)
        with watched(browser, path, 1200) as page:
            page.wait_for_selector("body[data-shown]")
            saved(page, "#save-zones", tmp_path, 2)
            mask = read_ros_map(tmp_path / "keepout.yaml")
            assert mask.spec == found.spec
            np.testing.assert_array_equal(mask.occupied == 1, closed)
            page.check("input[value=zone]")
            for corner in ZONE:
                click(page, *corner)
            page.click("#close-zone")
            drawn = tmp_path / f"{name} drawn"
            drawn.mkdir()
            saved(page, "#save-zones", drawn, 2)
        both = read_ros_map(drawn / "keepout.yaml").occupied == 1
        assert both[closed].all()
        assert both.sum() > closed.sum() + 50


def test_corrected_doors_are_read_again(page, folder: Path, tmp_path: Path) -> None:
    assert len(FromMap(folder, least_probability=0.5)._place.doors) == 2
    page.locator("#doors button").nth(0).click()
    page.click("#reject")
    page.locator("#doors button").nth(1).click()
    page.click("#confirm")
    page.check("input[value=door]")
    click(page, 3.0, -0.5)
    click(page, 3.0, 0.4)
    assert "A1: added" in page.inner_text("#doors")
    (path,) = saved(page, "#save-doors", tmp_path, 1)
    stored = json.loads(path.read_text())
    doors = {feature["id"]: feature["properties"] for feature in stored["features"]}
    assert set(doors) == {2, 3}
    assert [feature["id"] for feature in stored["not_doors"]] == [1]
    assert (doors[2]["probability"], doors[2]["found_probability"]) == (1, 0.62)
    assert doors[3]["width_m"] == pytest.approx(0.9, abs=0.05)
    for name in ("map.yaml", "map.pgm"):
        (tmp_path / name).write_bytes((folder / name).read_bytes())
    read = FromMap(tmp_path, least_probability=0.9)._place.doors
    assert sorted(round(door.hinge[0], 1) for door in read) == [2.0, 3.0]


def test_saved_files_are_read_again_in_another_browser(browser, folder, tmp_path: Path) -> None:
    with watched(browser, folder / "map.html", 1200) as page:
        page.wait_for_selector("body[data-shown]")
        page.check("input[value=zone]")
        for corner in ZONE:
            click(page, *corner)
        page.click("#close-zone")
        page.locator("#doors button").nth(0).click()
        page.click("#reject")
        page.locator("#doors button").nth(1).click()
        page.click("#confirm")
        page.check("input[value=door]")
        click(page, 3.0, -0.5)
        click(page, 3.0, 0.4)
        yaml_file, _ = saved(page, "#save-zones", tmp_path, 2)
        doors = page.inner_text("#doors")
        zones = page.inner_text("#zones")
        saved(page, "#save-doors", tmp_path, 1)
        doors_file = tmp_path / "doors.geojson"
    stored = json.loads(doors_file.read_text())
    for feature in (*stored["features"], *stored["not_doors"]):
        feature["id"] += 10  # as after another run, which numbers the doors anew
    doors_file.write_text(json.dumps(stored))
    other = browser.new_context(viewport={"width": 1200, "height": 800})
    page = other.new_page()
    page.goto((folder / "map.html").as_uri())
    page.wait_for_selector("body[data-shown]")
    assert page.inner_text("#zones") == "none drawn"
    page.set_input_files("#read", [yaml_file, doors_file])
    page.wait_for_function("document.getElementById('told').textContent.includes('read')")
    assert "1 zones read; doors read: 1 confirmed, 1 not doors, 1 added" in page.inner_text("#told")
    assert page.inner_text("#doors") == doors
    assert page.inner_text("#zones") == zones
    again = tmp_path / "again"
    again.mkdir()
    saved(page, "#save-zones", again, 2)
    for name in ("keepout.yaml", "keepout.pgm"):
        assert (again / name).read_bytes() == (tmp_path / name).read_bytes()
    other.close()


@pytest.mark.parametrize(
    ("name", "content", "told"),
    [
        ("map.yaml", "image: map.pgm\n", "no zones"),
        ("keepout.yaml", "# zones: [[[0, 0], [1, 0]]]\n", "no polygons"),
        ("doors.geojson", '{"type": "FeatureCollection"}', "no doors"),
        ("doors.geojson", '{"type": "FeatureCollection", "features": []}', "no doors"),
        ("doors.geojson", "{", "JSON"),
        ("a.png", "\x89PNG", "no zones"),
    ],
)
def test_other_files_change_nothing(page, tmp_path: Path, name: str, content: str, told: str):
    page.check("input[value=zone]")
    for corner in ZONE:
        click(page, *corner)
    page.click("#close-zone")
    page.locator("#doors button").nth(0).click()
    page.click("#reject")
    before = page.inner_text("#zones"), page.inner_text("#doors")
    (tmp_path / name).write_text(content)
    page.set_input_files("#read", tmp_path / name)
    page.wait_for_function("document.getElementById('told').textContent.includes('not a file')")
    assert told in page.inner_text("#told")
    assert page.inner_text("#told").startswith(name)
    assert (page.inner_text("#zones"), page.inner_text("#doors")) == before


def test_corrections_are_still_there_when_the_page_is_opened_again(page) -> None:
    page.locator("#doors button").nth(0).click()
    page.click("#reject")
    page.reload()
    page.wait_for_selector("body[data-shown]")
    assert "1: not a door" in page.inner_text("#doors")
    page.locator("#doors button").nth(0).click()
    page.click("#undo")
    assert "1: 95 %" in page.inner_text("#doors")


def test_too_narrow_a_door_and_too_small_a_zone_are_refused(page) -> None:
    page.check("input[value=door]")
    click(page, 1.5, 0.0)
    click(page, 1.5, 0.1)
    assert "too narrow" in page.inner_text("#told")
    page.check("input[value=zone]")
    click(page, 1.0, 0.0)
    page.click("#close-zone")
    assert "three corners" in page.inner_text("#told")
    page.keyboard.press("Escape")
    assert page.locator("#drafting").is_hidden()


def test_the_keyboard_alone_does_it_all(page) -> None:
    reached = set()
    for _ in range(60):
        page.keyboard.press("Tab")
        reached.add(page.evaluate("document.activeElement.id || document.activeElement.name"))
    assert {"stage", "closer", "moment", "play", "base", "tool", "save-doors"} <= reached
    page.focus("input[name=tool][value=look]")
    page.keyboard.press("ArrowDown")  # to the zones
    page.keyboard.press("Shift+Tab")  # so that the map shows its cross
    page.focus("#stage")
    for keys in (["+", "+"], ["ArrowRight", "ArrowRight"], ["ArrowUp", "ArrowUp"]):
        for key in keys:
            page.keyboard.press(key)
        page.keyboard.press("Enter")
    page.focus("#close-zone")
    page.keyboard.press("Enter")
    assert page.inner_text("#zones").startswith("1: 3 corners")
    page.locator("#doors button").nth(1).focus()
    page.keyboard.press("Enter")
    assert page.inner_text("#door-name") == "Door 2"


@pytest.mark.parametrize("width", [320, 390, 768, 1200])
def test_it_fits_the_width_of_a_screen(page, width: int) -> None:
    page.set_viewport_size({"width": width, "height": 800})
    page.wait_for_timeout(100)
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    box = page.locator("#stage").bounding_box()
    assert 0.6 * width < box["width"] <= width
    for name in ("closer", "play", "save-doors"):
        assert page.locator(f"#{name}").bounding_box()["height"] >= 24


def test_a_run_that_only_localised_has_a_page_of_its_belief(browser, folder: Path) -> None:
    with watched(browser, folder / "localised.html") as opened:
        opened.wait_for_selector("body[data-shown]")
        assert opened.title() == "a <drive> & more"
        assert opened.locator("input[name=base]").count() == 1
        assert opened.inner_text("#doors") == "none found"


def test_the_same_map_gives_the_same_page(folder: Path) -> None:
    text = (folder / "map.html").read_text()
    assert text == (folder / "again.html").read_text()
    assert "http" not in text.replace("http-equiv", "")
