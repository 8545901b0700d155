import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dynslam_env import Corridor, Door, Layout, Loop, Office
from slam import InputError, Pose2

floats = st.floats(allow_nan=False, allow_infinity=False)
sizes = st.floats(1e-3, 1e3)
points = st.tuples(floats, floats)
turns = st.floats(-2 * math.pi, 2 * math.pi)
doors = st.builds(Door, points, turns, st.sampled_from([1, -1]), sizes, sizes)
layouts = st.builds(
    lambda walls, doors, start, path, routes: Layout(
        np.array(walls).reshape(-1, 4), tuple(doors), Pose2(*start), path, tuple(routes)
    ),
    st.lists(
        st.tuples(floats, floats, floats, floats).filter(lambda w: w[:2] != w[2:]), max_size=4
    ),
    st.lists(doors, max_size=3),
    st.tuples(floats, floats, floats),
    st.lists(points, min_size=1, max_size=4),
    st.lists(st.lists(points, min_size=2, max_size=4, unique=True), max_size=2),
)

SMALL = """{
  "format": "dynslam-world-1",
  "walls": [
    [0, 0, 4, 0],
    [4, 0, 4, 2]
  ],
  "doors": [
    {"hinge": [1, 2], "closed": 0, "swing": 1, "width": 0.9, "thickness": 0.04}
  ],
  "start": [1, 1, 0],
  "path": [
    [1, 1],
    [3, 1]
  ]
}
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("worlds")


def bits(layout):
    routes = [route.tobytes() for route in layout.routes]
    arrays = layout.walls.tobytes(), layout.path.tobytes(), np.array(layout.start).tobytes()
    doors = [(np.array([*d.hinge, *d[1:]]).tobytes(), type(d.swing)) for d in layout.doors]
    return arrays, doors, routes, layout.walls.shape


@given(layout=layouts)
def test_what_is_read_is_what_was_saved_to_the_bit(folder, layout):
    layout.save(folder / "world.json")
    assert bits(Layout.load(folder / "world.json")) == bits(layout)


@pytest.mark.parametrize("world", [Corridor(people=2), Loop(), Office(furniture=2, people=1)])
def test_drawn_worlds_too(world, folder):
    layout = world.layout(np.random.default_rng(0))
    layout.save(folder / "drawn.json")
    assert bits(Layout.load(folder / "drawn.json")) == bits(layout)


def test_one_item_a_line(folder):
    layout = Corridor(people=2).layout(np.random.default_rng(0))
    layout.save(folder / "lines.json")
    lines = (folder / "lines.json").read_text().splitlines()
    items = [line for line in lines if line.startswith("    ")]
    assert len(items) == len(layout.walls) + len(layout.doors) + len(layout.path) + 2
    for item in items:
        json.loads(item.rstrip(","))
    assert len(lines) - len(items) == 12


def test_a_file_written_by_hand(folder):
    (folder / "hand.json").write_text(SMALL)
    layout = Layout.load(folder / "hand.json")
    assert layout.walls.tolist() == [[0, 0, 4, 0], [4, 0, 4, 2]]
    assert layout.doors == (Door((1.0, 2.0), 0.0, 1, 0.9, 0.04),)
    assert layout.start == Pose2(1.0, 1.0, 0.0)
    assert layout.routes == ()


def test_with_the_mark_that_windows_editors_put_first(folder):
    (folder / "mark.json").write_bytes(b"\xef\xbb\xbf" + SMALL.encode())
    assert len(Layout.load(folder / "mark.json").walls) == 2


def replaced(old, new):
    assert SMALL.count(old) == 1
    return SMALL.replace(old, new)


MALFORMED = {
    "": r":1:1: expected JSON",
    "walls: none": r":1:1: expected JSON",
    SMALL[:-4]: r":\d+:\d+: expected JSON",
    replaced("[0, 0, 4, 0],", "[0, 0, 4, 0]"): r":5:5: expected JSON, but Expecting ',' delimiter",
    "[1, 2]": r": must be an object with the keys format, walls, .*, got \[1, 2\]",
    "null": r": must be an object with the keys .*, got null",
    "[" * 100000: r": expected a world, but lists are nested too deeply",
    replaced("world-1", "world-2"): r': "format" must be "dynslam-world-1", got "dynslam-world-2',
    replaced('"format": "dynslam-world-1",', ""): r': the key "format" is missing',
    replaced('"start": [1, 1, 0],', ""): r': the key "start" is missing; needed are format, walls',
    replaced('"start"', '"begin"'): r': the key "start" is missing',
    replaced('"path"', '"colour": 1, "path"'): r': there is no key "colour"; allowed are format',
    replaced('"start"', '"path": [], "start"'): r': .*key "path" is given twice, allowed is once',
    replaced("[4, 0, 4, 2]", "[4, 0, 4]"): r": walls\[1\] must be .* x1, y1, x2, y2, got \[4, 0, 4",
    replaced("[4, 0, 4, 2]", "[4, 0, 4, NaN]"): r": walls\[1\]\[3\] must be a finite .* got NaN",
    replaced("[4, 0, 4, 2]", "[4, 0, 4, 1e999]"): r": walls\[1\]\[3\] must be a finite number, got",
    replaced("[4, 0, 4, 2]", f"[4, 0, 4, {10**400}]"): r": walls\[1\]\[3\] must be a finite number",
    replaced("[4, 0, 4, 2]", '[4, 0, 4, "2"]'): r': walls\[1\]\[3\] must be a finite .* got "2"',
    replaced("[4, 0, 4, 2]", "[4, 0, 4, true]"): r": walls\[1\]\[3\] must be a finite .* got true",
    replaced("[4, 0, 4, 2]", "7"): r": walls\[1\] must be a list of the numbers",
    replaced("[1, 1, 0]", "[1, 1]"): r": start must be a list of the numbers x, y, theta",
    replaced("[3, 1]", "[3, 1, 0]"): r": path\[1\] must be a list of the numbers x, y, got",
    replaced("[\n    [1, 1],\n    [3, 1]\n  ]", "[]"): r": Layout.path needs at least one waypoint",
    replaced("[\n    [1, 1],\n    [3, 1]\n  ]", "5"): r": path must be a list, got 5",
    replaced('"swing": 1', '"swing": 2'): r": doors\[0\]\.swing must be 1 or -1, got 2",
    replaced('"swing": 1', '"swing": true'): r": doors\[0\]\.swing must be 1 or -1, got true",
    replaced('"width": 0.9', '"width": 0'): r": Layout\.doors\[0\]\.width .* above 0, got 0",
    replaced('"width": 0.9,', ""): r': doors\[0\]: the key "width" is missing',
    replaced('"width": 0.9', '"wide": 1, "width": 0.9'): r': doors\[0\]: there is no key "wide"',
    replaced('"hinge": [1, 2]', '"hinge": 1'): r": doors\[0\]\.hinge must be a list of the numbers",
    replaced('"path"', '"routes": [[[1, 1]]], "path"'): r": Layout\.routes\[0\] needs at least two",
    replaced('"path"', '"routes": {}, "path"'): r": routes must be a list, got {}",
}


@pytest.mark.parametrize(("text", "message"), MALFORMED.items(), ids=MALFORMED.values())
def test_malformed_files_are_refused(folder, text, message):
    path = folder / "malformed.json"
    path.write_text(text)
    with pytest.raises(InputError, match=rf"malformed\.json{message}") as caught:
        Layout.load(path)
    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith(str(path))


def test_bytes_that_are_no_text_are_refused(folder):
    (folder / "bytes.json").write_bytes(b'{"format": "\xff"}')
    with pytest.raises(InputError, match=r"bytes\.json: expected JSON in UTF-8, byte 12 is not"):
        Layout.load(folder / "bytes.json")


def test_files_that_are_not_there_are_refused(folder):
    with pytest.raises(InputError, match=r"none\.json: no such file"):
        Layout.load(folder / "none.json")
    with pytest.raises(InputError, match="a file was expected, this is a directory"):
        Layout.load(folder)
    with pytest.raises(InputError, match="cannot be written"):
        Layout.load(save_small(folder)).save(folder / "nowhere" / "world.json")


def save_small(folder):
    (folder / "small.json").write_text(SMALL)
    return folder / "small.json"


def test_a_failed_save_leaves_the_old_file(folder, monkeypatch):
    path = save_small(folder)
    layout = Layout.load(path)
    layout.walls.flags.writeable = True
    layout.walls[0, 0] = math.nan  # as only a careless caller does
    with pytest.raises(ValueError, match="Out of range float values"):
        layout.save(path)
    assert path.read_text() == SMALL
    assert [each for each in folder.iterdir() if each.suffix == ".tmp"] == []
