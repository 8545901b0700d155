import json
from pathlib import Path

import numpy as np
import pytest

from slam.errors import InputError
from slam.grid import GridSpec
from slam.io.layers import COLOURS, FRAME, picture, read_layers, write_doors, write_layers
from slam.layers import Layers
from tests.slam.layers.test_layers import doors

MADE = doors(30, 60, 2)


def test_layers_come_back(tmp_path: Path) -> None:
    write_layers(MADE, tmp_path / "layers.npz")
    back = read_layers(tmp_path / "layers.npz")
    assert back.spec == MADE.spec
    for name in ("kind", "reason", "occupied", "rate", "watched"):
        np.testing.assert_array_equal(getattr(back, name), getattr(MADE, name))
    assert len(back.doors) == len(MADE.doors) == 1
    np.testing.assert_array_equal(back.doors[0].ends, MADE.doors[0].ends)
    assert back.doors[0][1:] == MADE.doors[0][1:]


def test_doors_are_closed_rings_in_metres(tmp_path: Path) -> None:
    write_doors(MADE, tmp_path / "doors.geojson")
    stored = json.loads((tmp_path / "doors.geojson").read_text())
    assert stored["type"] == "FeatureCollection"
    assert stored["frame"] == FRAME
    (feature,) = stored["features"]
    (ring,) = feature["geometry"]["coordinates"]
    assert ring[0] == ring[-1]
    x, y = np.array(ring).T
    area = 0.5 * (x[:-1] * y[1:] - x[1:] * y[:-1]).sum()
    assert area == pytest.approx(MADE.doors[0].width * 0.1, rel=0.05)  # counter-clockwise
    assert feature["properties"]["kind"] == "door"
    assert feature["properties"]["probability"] == pytest.approx(
        MADE.doors[0].probability, abs=1e-3
    )
    hinge = MADE.doors[0].ends[MADE.doors[0].hinge]
    assert feature["properties"]["hinge"] == pytest.approx(hinge.tolist(), abs=1e-3)
    assert feature["properties"]["open_share"] == pytest.approx(MADE.doors[0].open_share, abs=1e-3)


def test_the_picture_shows_the_layers() -> None:
    pixels = picture(MADE)
    assert (pixels[MADE.static] == COLOURS["static"]).all()
    assert (pixels[MADE.kept] == COLOURS["kept"]).all()
    assert (pixels[MADE.free] == 255).all()
    assert (pixels[MADE.unknown] == 205).all()
    assert (pixels[MADE.changing][:, 0] > pixels[MADE.changing][:, 2]).all()


def test_layers_of_a_large_map_are_read_again(tmp_path: Path) -> None:
    """A small file of many cells, most of which no echo came from: csail has 2.2 million."""
    shape = 1800, 1400
    kind = np.zeros(shape, np.uint8)
    watched, rate = np.zeros(shape, np.float32), np.zeros(shape, np.float32)
    occupied = np.full(shape, np.nan, np.float32)
    kind[900, 700], watched[900, 700], occupied[900, 700], rate[900, 700] = 2, 3.5, 0.25, 7.0
    spec = GridSpec(0.05, -900, -700, *shape)
    write_layers(Layers(spec, kind, kind * 0, occupied, rate, watched, ()), tmp_path / "a.npz")
    assert (tmp_path / "a.npz").stat().st_size < 100_000
    read = read_layers(tmp_path / "a.npz")
    for name in ("kind", "occupied", "rate", "watched"):
        made = {"kind": kind, "occupied": occupied, "rate": rate, "watched": watched}[name]
        np.testing.assert_array_equal(getattr(read, name), made)


@pytest.mark.parametrize("content", [b"", b"no layers", b"PK\x03\x04 cut short"])
def test_other_files_are_told(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "layers.npz"
    path.write_bytes(content)
    with pytest.raises(InputError, match="layers"):
        read_layers(path)
    with pytest.raises(InputError, match="no such file"):
        read_layers(tmp_path / "absent.npz")


def test_another_format_and_wrong_shapes_are_told(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", format="something else")
    with pytest.raises(InputError, match="expected dynslam-layers-3"):
        read_layers(tmp_path / "a.npz")
    write_layers(MADE, tmp_path / "b.npz")
    stored = dict(np.load(tmp_path / "b.npz"))
    np.savez(tmp_path / "b.npz", **{**stored, "kind": stored["kind"][1:]})
    with pytest.raises(InputError, match="not layers"):
        read_layers(tmp_path / "b.npz")
