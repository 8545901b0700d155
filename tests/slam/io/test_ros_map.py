import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from slam.errors import InputError
from slam.grid import GridSpec, OccupancyGrid
from slam.io.ros_map import read_ros_map, write_filter_mask, write_ros_map


def grid_of(states: np.ndarray, spec: GridSpec) -> OccupancyGrid:
    """States: 0 unknown, 1 free, 2 occupied."""
    occupied = np.select([states == 1, states == 2], [0.0, 1.0], 0.5)
    return OccupancyGrid(spec, occupied, states > 0)


@settings(max_examples=40)
@given(
    st.integers(0, 10_000),
    st.sampled_from([0.05, 0.1, 0.025, 1 / 3]),
    st.integers(-5000, 5000),
    st.integers(-5000, 5000),
)
def test_round_trip_is_exact(seed: int, resolution: float, row0: int, col0: int) -> None:
    rng = np.random.default_rng(seed)
    spec = GridSpec(resolution, row0, col0, *rng.integers(1, 30, 2).tolist())
    grid = grid_of(rng.integers(0, 3, spec.shape), spec)
    with tempfile.TemporaryDirectory() as folder:
        write_ros_map(grid, Path(folder) / "map")
        back = read_ros_map(Path(folder) / "map.yaml")
    assert back.spec == spec
    assert (back.occupied == grid.occupied).all()
    assert (back.observed == grid.observed).all()


def test_the_files_by_hand(tmp_path: Path) -> None:
    spec = GridSpec(0.05, -2, -4, 2, 3)
    write_ros_map(grid_of(np.array([[0, 1, 2], [1, 1, 1]]), spec), tmp_path / "map")
    pixels = bytes([254, 254, 254, 205, 254, 0])  # the upper row, y from -0.05 on, comes first
    assert (tmp_path / "map.pgm").read_bytes() == b"P5\n3 2\n255\n" + pixels
    yaml = (tmp_path / "map.yaml").read_text().splitlines()
    assert "image: map.pgm" in yaml
    assert "origin: [-0.2, -0.1, 0.0]" in yaml
    assert "free_thresh: 0.196" in yaml


def test_a_map_of_another_program(tmp_path: Path) -> None:
    (tmp_path / "m.pgm").write_bytes(b"P5\n# CREATOR: map_saver\n2 1\n255\n" + bytes([0, 205]))
    (tmp_path / "m.yaml").write_text(
        'image: "m.pgm"  # a comment\nresolution: 0.050000\norigin: [-10.01, 5.0, 0.000000]\n'
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    grid = read_ros_map(tmp_path / "m.yaml")
    assert grid.spec == GridSpec(0.05, 100, -200, 1, 2)
    assert grid.occupied.tolist() == [[1, 0.5]]
    assert grid.observed.tolist() == [[True, False]]


def nav2_cells(path: Path) -> np.ndarray:
    """(rows, cols) percent, -1 unknown: what nav2_map_server publishes of a map, lowest row first.

    By the rules of loadMapFromFile in its map_io.cpp, read by other libraries than ours.
    """
    about = pytest.importorskip("yaml").safe_load(path.read_text())
    with Image.open(path.parent / about["image"]) as picture:
        shade = np.asarray(picture.convert("L"), dtype=np.float64)[::-1] / 255
    occ = shade if about["negate"] else 1 - shade
    low, high = about["free_thresh"], about["occupied_thresh"]
    if about["mode"] == "raw":
        percent = np.round(shade * 255)
        return np.where(percent <= 100, percent, -1)
    between = -1 if about["mode"] == "trinary" else np.rint((occ - low) / (high - low) * 100)
    return np.select([high < occ, occ < low], [100, 0], between)


@pytest.mark.parametrize("seed", range(3))
def test_nav2_reads_what_was_written(tmp_path: Path, seed: int) -> None:
    rng = np.random.default_rng(seed)
    spec = GridSpec(0.05, -7, 3, 9, 14)
    states = rng.integers(0, 3, spec.shape)
    write_ros_map(grid_of(states, spec), tmp_path / "map.yaml")
    assert (
        nav2_cells(tmp_path / "map.yaml") == np.select([states == 1, states == 2], [0, 100], -1)
    ).all()
    percent = rng.integers(-1, 101, spec.shape)
    write_filter_mask(percent, spec, tmp_path / "mask.yaml")
    assert (nav2_cells(tmp_path / "mask.yaml") == percent).all()
    about = pytest.importorskip("yaml").safe_load((tmp_path / "mask.yaml").read_text())
    assert about["mode"] == "raw"
    assert about["origin"] == pytest.approx([0.15, -0.35, 0.0])
    assert {"image", "resolution", "negate", "occupied_thresh", "free_thresh"} <= set(about)


@pytest.mark.parametrize("mode", ["trinary", "scale", "raw"])
@pytest.mark.parametrize("negate", [0, 1])
def test_each_mode_is_read_as_nav2_reads_it(tmp_path: Path, mode: str, negate: int) -> None:
    pixels = np.arange(256, dtype=np.uint8).reshape(16, 16)
    Image.fromarray(pixels).save(tmp_path / "m.pgm")
    (tmp_path / "m.yaml").write_text(
        f"image: m.pgm\nmode: {mode}\nresolution: 0.1\norigin: [0.0, 0.0, 0.0]\nnegate: {negate}\n"
        "occupied_thresh: 0.81\nfree_thresh: 0.21\n"
    )
    ours, theirs = read_ros_map(tmp_path / "m.yaml"), nav2_cells(tmp_path / "m.yaml")
    assert (ours.observed == (theirs >= 0)).all()
    assert np.abs(100 * ours.occupied - theirs)[ours.observed].max() <= 0.5
    assert (ours.occupied[~ours.observed] == 0.5).all()


@pytest.mark.parametrize("ending", ["p2.pgm", "png", "rgb.png", "bmp"])
def test_a_map_edited_by_hand_is_read(tmp_path: Path, ending: str) -> None:
    """Picture editors write PGM as text, PNG, or colours."""
    spec = GridSpec(0.05, 0, 0, 2, 3)
    write_ros_map(grid_of(np.array([[0, 1, 2], [1, 1, 1]]), spec), tmp_path / "map.yaml")
    with Image.open(tmp_path / "map.pgm") as picture:
        edited = picture.convert("RGB" if "rgb" in ending else "L")
    edited.putpixel((0, 0), (0, 0, 0) if "rgb" in ending else 0)  # the cell at the upper left
    if ending == "p2.pgm":
        numbers = " ".join(map(str, np.asarray(edited).ravel().tolist()))
        (tmp_path / f"m.{ending}").write_text(f"P2\n# by hand\n3 2\n255\n{numbers}\n")
    else:
        edited.save(tmp_path / f"m.{ending}")
    text = (tmp_path / "map.yaml").read_text().replace("map.pgm", f"m.{ending}")
    (tmp_path / "map.yaml").write_text(text)
    grid = read_ros_map(tmp_path / "map.yaml")
    assert grid.occupied.tolist() == [[0.5, 0, 1], [1, 0, 0]]


GOOD = {
    "image": "map.pgm",
    "resolution": "0.05",
    "origin": "[0, 0, 0]",
    "occupied_thresh": "0.65",
    "free_thresh": "0.196",
}


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("image", "none.pgm", "no such file"),
        ("image", "map.yaml", "binary PGM"),
        ("image", "short.pgm", "9 x 9 pixels"),
        ("image", "huge.pgm", "999999999 x 999999999 pixels"),
        ("image", "deep.pgm", "8 bits"),
        ("resolution", "wide", "a number for `resolution`"),
        ("resolution", "-1", "from 0.0001"),
        ("resolution", None, "`resolution: ...`"),
        ("origin", "[0, 0]", r"\[x, y, yaw\]"),
        ("origin", "[0, 0, 0.5]", "not turned"),
        ("mode", "grey", "trinary, scale, raw"),
        ("image", "deep.png", "8 bits"),
        ("image", "cut.png", "cannot be read as a picture"),
        ("free thresh", "1", "map.yaml:6: expected `key: value`"),
    ],
)
def test_bad_files_are_refused(tmp_path: Path, key: str, value: str | None, message: str) -> None:
    (tmp_path / "map.pgm").write_bytes(b"P5\n1 1\n255\n\0")
    (tmp_path / "short.pgm").write_bytes(b"P5\n9 9\n255\n\0")
    (tmp_path / "huge.pgm").write_bytes(b"P5\n999999999 999999999\n255\n\0")
    (tmp_path / "deep.pgm").write_bytes(b"P5\n1 1\n65535\n\0\0")
    Image.fromarray(np.zeros((1, 1), np.uint16)).save(tmp_path / "deep.png")
    (tmp_path / "cut.png").write_bytes((tmp_path / "deep.png").read_bytes()[:20])
    fields = GOOD | {key: value}
    text = "".join(f"{name}: {field}\n" for name, field in fields.items() if field is not None)
    (tmp_path / "map.yaml").write_text(text)
    with pytest.raises(InputError, match=message):
        read_ros_map(tmp_path / "map.yaml")


def test_an_unwritable_place_is_one_line(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be written"):
        write_ros_map(grid_of(np.zeros((1, 1)), GridSpec(1, 0, 0, 1, 1)), tmp_path / "none" / "map")


def test_the_map_of_a_hall_is_read_again(tmp_path: Path) -> None:
    """Its YAML is small, and its picture of 7 million cells takes more than small files may."""
    spec = GridSpec(0.05, 0, 0, 2500, 2800)
    unknown = np.zeros(spec.shape, np.bool_)
    write_ros_map(OccupancyGrid(spec, np.full(spec.shape, 0.5), unknown), tmp_path / "hall.yaml")
    assert read_ros_map(tmp_path / "hall.yaml").spec == spec
