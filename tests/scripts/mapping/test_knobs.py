# pyright: reportMissingImports=false
"""The options of `dynslam map` that say what is used of a recording, and how maps are drawn."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from dynslam_cli import main
from dynslam_cli.console import free_memory
from dynslam_cli.mapping import map_size

from dynslam_env import FromMap
from slam.episode import Episode
from slam.geometry import Pose2
from slam.grid import GridSpec, OccupancyGrid
from slam.io.formats import write_log
from slam.io.layers import read_layers
from slam.io.ros_map import read_ros_map, write_ros_map
from slam.io.tum import read_tum
from slam.layers.wall_direction import wall_direction
from slam.preprocessing.laser_sense import turned_over
from slam.sessions.session import Session

QUICK = ["--skip", "mcap,rrd", "--slam", "static-ml"]


@pytest.fixture(scope="module")
def recording(tmp_path_factory, short_episode: Episode) -> Path:
    path = tmp_path_factory.mktemp("knobs") / "drive.npz"
    write_log(short_episode, path)
    return path


def mapped(recording: Path, out: Path, *more: str) -> dict:
    assert main.status(["map", str(recording), "--out", str(out), *QUICK, *more]) == 0
    return json.loads((out / "summary.json").read_text())


@pytest.fixture(scope="module")
def usual(recording: Path, tmp_path_factory) -> Path:
    """The map without any knob."""
    out = tmp_path_factory.mktemp("usual")
    mapped(recording, out)
    return out


def test_config_repeats_the_run_to_the_byte(recording: Path, tmp_path: Path) -> None:
    knobs = ["--to", "6", "--max-range", "5", "--resolution", "0.1", "--keep", "all", "--seed", "3"]
    first = mapped(recording, tmp_path / "a", *knobs)
    assert "config.toml" in first["files"]
    config = str(tmp_path / "a" / "config.toml")
    assert main.status(["map", "--config", config, "--out", str(tmp_path / "b")]) == 0
    for name in ("map.pgm", "belief.pgm", "trajectory.tum", "keepout.pgm", "config.toml"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes(), name


def test_a_part_of_the_time_is_mapped(recording: Path, usual: Path, tmp_path: Path) -> None:
    assert mapped(recording, tmp_path, "--from", "2", "--to", "5")["scans"] == 31
    whole, part = (read_tum(folder / "trajectory.tum") for folder in (usual, tmp_path))
    assert part.times[0] == pytest.approx(whole.times[0] + 2.0)
    assert part.times[-1] == pytest.approx(whole.times[0] + 5.0)


def test_the_range_is_limited(recording: Path, tmp_path: Path) -> None:
    near = mapped(recording, tmp_path, "--max-range", "2", "--min-range", "0.5")
    scans = Session.load(tmp_path / "session.npz").scans
    assert {(scan.min_range, scan.max_range) for scan in scans} == {(0.5, 2.0)}
    echoes = np.concatenate([scan.ranges[scan.hit] for scan in scans])
    assert echoes.min() >= 0.5
    assert echoes.max() < 2.0
    assert near["scans"] == 80


@pytest.mark.parametrize("resolution", [0.025, 0.1])
def test_maps_are_drawn_in_cells_of_any_size(
    recording: Path, usual: Path, tmp_path: Path, resolution: float
) -> None:
    mapped(recording, tmp_path, "--resolution", str(resolution))
    for name in ("map.yaml", "belief.yaml", "keepout.yaml", "speed.yaml"):
        made, before = read_ros_map(tmp_path / name), read_ros_map(usual / name)
        assert made.spec.resolution == resolution
        area, old = made.observed.sum() * resolution**2, before.observed.sum() * 0.05**2
        assert area == pytest.approx(old, rel=0.12), name
    assert (tmp_path / "trajectory.tum").read_bytes() == (usual / "trajectory.tum").read_bytes()
    doors = [(folder / "doors.geojson").read_bytes() for folder in (tmp_path, usual)]
    assert doors[0] == doors[1]


def test_what_counts_as_standing_is_chosen(recording: Path, usual: Path, tmp_path: Path) -> None:
    layers, areas = read_layers(usual / "layers.npz"), []
    for keep in ("none", "once,part", "all"):
        mapped(recording, tmp_path / keep, "--keep", keep)
        areas.append((read_ros_map(tmp_path / keep / "map.yaml").occupied == 1).sum())
    assert areas[0] == layers.static.sum()
    assert areas[1] == (layers.static | layers.kept).sum()
    assert areas[2] == (layers.static | (layers.reason > 0)).sum()
    assert areas[0] < areas[2]


def test_walls_become_parallel_to_the_axes(recording: Path, tmp_path: Path, short_episode, capsys):
    from slam.sessions.session import session_of

    turned = replace(
        short_episode,
        scans=tuple(
            replace(scan, mount=Pose2(0.0, 0.0, math.radians(25.0))) for scan in short_episode.scans
        ),
        odometry=replace(
            short_episode.odometry,
            poses=np.column_stack([
                *(short_episode.odometry.poses[:, :2] @ _turn(25.0)).T,
                short_episode.odometry.poses[:, 2],
            ]),
        ),
    )  # fmt: skip
    write_log(turned, tmp_path / "turned.npz")
    mapped(tmp_path / "turned.npz", tmp_path / "out", "--align")
    assert "the map is turned by" in capsys.readouterr().err
    session = Session.load(tmp_path / "out" / "session.npz")
    assert abs(math.degrees(wall_direction(session.scans, session.poses))) < 0.3
    straight = session_of(turned, turned.odometry.at(turned.times))
    assert abs(math.degrees(wall_direction(straight.scans, straight.poses))) > 5


def _turn(degrees: float) -> np.ndarray:
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return np.array([[c, s], [-s, c]])


# -- masks -------------------------------------------------------------------------------------


def mask_over(usual: Path, path: Path, resolution: float, share: float = 1.0) -> None:
    """Write a mask of a resolution, black over a part (from the left) of the map's box."""
    left, right, low, high = read_ros_map(usual / "map.yaml").spec.extent
    right = left + share * (right - left)
    cols, rows = math.ceil((right - left) / resolution), math.ceil((high - low) / resolution)
    spec = GridSpec(resolution, round(low / resolution), round(left / resolution), rows, cols)
    black = np.ones(spec.shape)
    write_ros_map(OccupancyGrid(spec, black, np.ones(spec.shape, bool)), path)


@pytest.mark.parametrize("resolution", [0.03, 0.05, 0.4])
def test_a_mask_of_any_size_and_resolution_clears_its_part(
    recording: Path, usual: Path, tmp_path: Path, resolution: float
) -> None:
    mask_over(usual, tmp_path / "mask.yaml", resolution, share=0.5)
    mapped(recording, tmp_path / "out", "--mask", str(tmp_path / "mask.yaml"))
    left, right, _, _ = read_ros_map(usual / "map.yaml").spec.extent
    middle = (left + right) / 2
    for name in ("map.yaml", "belief.yaml"):
        made, before = read_ros_map(tmp_path / "out" / name), read_ros_map(usual / name)
        x = made.spec.centres(np.indices(made.spec.shape).reshape(2, -1).T)[:, 0]
        within = (x < middle - resolution).reshape(made.spec.shape)
        beyond = (x > middle + resolution).reshape(made.spec.shape)
        assert (before.occupied[within] == 1).any()
        assert not (made.occupied[within] == 1).any()
        assert made.observed[before.observed].all()
        assert (made.occupied[beyond] == before.occupied[beyond]).all()


def test_a_keepout_mask_can_be_a_mask(recording: Path, usual: Path, tmp_path: Path) -> None:
    """As Nav2's tutorials write them: `scale`, or `raw` as of keepout.yaml."""
    text = (usual / "keepout.yaml").read_text().replace("keepout.pgm", "mine.pgm")
    (tmp_path / "mine.yaml").write_text(text)
    head, pixels = (usual / "keepout.pgm").read_bytes().split(b"255\n", 1)
    (tmp_path / "mine.pgm").write_bytes(head + b"255\n" + bytes([100]) * len(pixels))
    mapped(recording, tmp_path / "out", "--mask", str(tmp_path / "mine.yaml"))
    assert not (read_ros_map(tmp_path / "out" / "map.yaml").occupied == 1).any()


def test_a_mask_that_misses_the_map_is_told(recording: Path, tmp_path: Path, capsys) -> None:
    spec = GridSpec(0.05, 9000, 9000, 20, 20)
    black = OccupancyGrid(spec, np.ones(spec.shape), np.ones(spec.shape, bool))
    write_ros_map(black, tmp_path / "far.yaml")
    mapped(recording, tmp_path / "out", "--mask", str(tmp_path / "far.yaml"))
    assert "no black cell of this mask lies where the map was seen" in capsys.readouterr().err


# -- mistakes ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("more", "why"),
    [
        (["--resolution", "0"], "--resolution must be from 0.005 to 1 m"),
        (["--resolution", "nan"], "--resolution must be from"),
        (["--keep", "glas"], "unknown kind of thing 'glas'"),
        (["--mask", "none.yaml"], "no such file"),
        (["--min-range", "5", "--max-range", "3"], "5 to 3 m"),
        (["--from", "1000"], "no scan lies between"),
        (["--robot-radius", "-1"], "above 0"),
        (["--laser", "/a", "--laser", "/b", "--mount", "0", "0", "0"], "--mount is of one laser"),
        (["--onto", "map.yaml"], "a picture of a map holds no scans"),
    ],
)
def test_mistakes_are_told_before_the_work(recording, tmp_path: Path, more, why, capsys) -> None:
    out = tmp_path / "out"
    assert main.status(["map", str(recording), "--out", str(out), *QUICK, *more]) == 2
    assert why in capsys.readouterr().err
    assert not out.exists()


@pytest.mark.parametrize(
    ("more", "why"),
    [
        (["--align"], "--align turns a new map"),
        (["--localise", "--resolution", "0.1"], "--localise writes no map"),
    ],
)
def test_knobs_of_a_new_map_are_refused_for_an_old_one(
    recording: Path, usual: Path, tmp_path: Path, more, why, capsys
) -> None:
    onto = ["--onto", str(usual / "session.npz"), *more]
    assert main.status(["map", str(recording), "--out", str(tmp_path / "o"), *QUICK, *onto]) == 2
    assert why in capsys.readouterr().err


def test_an_empty_mask_is_refused(recording: Path, tmp_path: Path, capsys) -> None:
    spec = GridSpec(0.05, 0, 0, 4, 4)
    white = OccupancyGrid(spec, np.zeros(spec.shape), np.ones(spec.shape, bool))
    write_ros_map(white, tmp_path / "white.yaml")
    arguments = ["--out", str(tmp_path / "out"), "--mask", str(tmp_path / "white.yaml")]
    assert main.status(["map", str(recording), *arguments, *QUICK]) == 2
    assert "no cell of this mask is black" in capsys.readouterr().err


def test_a_resolution_that_needs_too_much_memory_is_refused_before_it_is_taken(
    recording: Path, tmp_path: Path, monkeypatch, capsys
) -> None:
    monkeypatch.setattr(map_size, "free_memory", lambda: 20e6)
    drawn = "dynslam_cli.mapping.map_recording.MappingRun"
    monkeypatch.setattr(drawn, lambda *_: pytest.fail("worked first"))
    knobs = ["--resolution", "0.01"]
    out = str(tmp_path / "out")
    assert main.status(["map", str(recording), "--out", out, *QUICK, *knobs]) == 2
    err = capsys.readouterr().err
    assert "--resolution 0.01: a map of" in err
    assert "million fit: --resolution 0.0" in err


def test_the_proposed_resolution_fits(recording: Path, short_episode: Episode, monkeypatch) -> None:
    monkeypatch.setattr(map_size, "free_memory", lambda: 20e6)
    poses = short_episode.odometry.at(short_episode.times)
    with pytest.raises(ValueError, match="coarser") as refused:
        map_size.check_size(short_episode.scans, poses, 0.01)
    proposed = float(str(refused.value).split(": --resolution ")[1].split()[0])
    map_size.check_size(short_episode.scans, poses, proposed)
    assert proposed < 0.1


def test_the_free_memory_is_that_of_the_machine_or_its_container(tmp_path: Path, monkeypatch):
    (tmp_path / "meminfo").write_text("MemTotal: 9 kB\nMemAvailable:    2000 kB\n")
    (tmp_path / "max").write_text("3000000\n")
    (tmp_path / "used").write_text("1500000\n")
    monkeypatch.setattr(free_memory, "MEMINFO", tmp_path / "meminfo")
    monkeypatch.setattr(free_memory, "GROUP_LIMITS", ())
    assert free_memory.free_memory() == 2000 * 1024
    limits = ((tmp_path / "max", tmp_path / "used"),)
    monkeypatch.setattr(free_memory, "GROUP_LIMITS", limits)
    assert free_memory.free_memory() == 1.5e6
    (tmp_path / "max").write_text("max\n")
    assert free_memory.free_memory() == 2000 * 1024


# -- lasers ------------------------------------------------------------------------------------


def test_a_laser_that_is_upside_down_is_turned_over(
    short_episode: Episode, usual: Path, tmp_path: Path, capsys
) -> None:
    from tests.slam.worlds import drive

    whole = replace(drive(n=150, bias=0.02), truth=None)
    write_log(turned_over(whole), tmp_path / "over.npz")
    write_log(whole, tmp_path / "up.npz")
    told = mapped(tmp_path / "over.npz", tmp_path / "over")
    mapped(tmp_path / "up.npz", tmp_path / "up")
    assert "upside down" in capsys.readouterr().err
    assert any("upside down" in warning for warning in told["warnings"])
    for name in ("map.pgm", "trajectory.tum"):
        assert (tmp_path / "over" / name).read_bytes() == (tmp_path / "up" / name).read_bytes()


def test_a_map_edited_by_hand_is_a_world_again(usual: Path, tmp_path: Path) -> None:
    """Painted over in an editor that writes plain PGM: a wall more is a wall more."""
    grid = read_ros_map(usual / "map.yaml")
    before = FromMap(usual / "map.yaml").layout(np.random.default_rng(0))
    picture = np.select([grid.occupied == 1, grid.observed], [0, 254], 205)[::-1]
    middle = np.argwhere(grid.observed[::-1] & (grid.occupied[::-1] == 0)).mean(axis=0).astype(int)
    picture[middle[0] - 3 : middle[0] + 3, middle[1] - 3 : middle[1] + 3] = 0
    numbers = "\n".join(" ".join(map(str, row)) for row in picture.tolist())
    rows, cols = picture.shape
    (tmp_path / "edited.pgm").write_text(f"P2\n# edited\n{cols} {rows}\n255\n{numbers}\n")
    text = (usual / "map.yaml").read_text().replace("map.pgm", "edited.pgm")
    (tmp_path / "map.yaml").write_text(text)
    after = FromMap(tmp_path / "map.yaml").layout(np.random.default_rng(0))
    assert len(after.walls) > len(before.walls)
    ((x, y),) = grid.spec.centres(np.array([(rows - 1 - middle[0], middle[1])]))
    near = np.hypot(*(after.walls[:, :2] - (x, y)).T) < 0.3
    assert near.any()
