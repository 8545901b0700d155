# pyright: reportMissingImports=false
from collections import defaultdict
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from dynslam_cli.figures import rerun_file
from dynslam_cli.figures.rerun_file import Picture, write_rrd

import slam
from slam.benchmark.run import Playback
from slam.benchmark.snapshots import SnapshotRecorder
from slam.episode import Episode
from slam.errors import InputError
from slam.interface import Estimate
from slam.maps.snapshot import MapSnapshot


class Drive(NamedTuple):
    episode: Episode
    estimates: list[Estimate]
    stages: list[MapSnapshot]


@pytest.fixture(scope="module")
def drive(short_episode: Episode) -> Drive:
    playback = Playback(slam.make("dynamic-ml"), short_episode)
    growth, estimates = SnapshotRecorder(playback, stages=4), []
    for number, estimate in enumerate(playback):
        growth.after(number)
        estimates.append(estimate)
    return Drive(short_episode, estimates, growth.stages())


@pytest.fixture(scope="module")
def columns(tmp_path_factory: pytest.TempPathFactory, drive: Drive) -> dict[str, list[Any]]:
    """ENTITY COLUMN -> its values, in the order of time."""
    pytest.importorskip("rerun")
    from rerun.chunk import RrdReader

    path = tmp_path_factory.mktemp("rrd") / "a.rrd"
    spec = drive.stages[-1].spec
    layer = Picture(spec, np.arange(spec.rows * spec.cols).reshape(spec.shape))
    write_rrd(path, *drive, layers={"count": layer})
    found = defaultdict(list)
    for chunk in RrdReader(path).stream():
        batch = chunk.to_record_batch()
        for name, column in zip(batch.schema.names, batch.columns, strict=True):
            found[f"{chunk.entity_path} {name}"] += column.to_pylist()
    return found


def test_every_scan_has_its_stamp_its_echoes_and_its_pose(
    columns: dict[str, list[Any]], drive: Drive
) -> None:
    scans = drive.episode.scans
    assert columns["/map/robot scan"] == list(range(len(scans)))
    stamps = [value.timestamp() for value in columns["/map/robot/scan time"]]
    assert stamps == pytest.approx([scan.time for scan in scans], abs=1e-5)
    moved = np.array(columns["/map/robot Transform3D:translation"]).reshape(-1, 3)
    assert np.allclose(moved[:, :2], [one.pose[:2] for one in drive.estimates], atol=1e-5)
    turned = np.array(columns["/map/robot Transform3D:quaternion"]).reshape(-1, 4)
    assert np.allclose(
        2 * np.arctan2(turned[:, 2], turned[:, 3]),
        [one.pose.theta for one in drive.estimates],
        atol=1e-5,
    )
    echoes = [row for row in columns["/map/robot/scan Points3D:positions"] if row]
    assert np.allclose(np.array(echoes[40])[:, :2], scans[40].points, atol=1e-5)


def test_the_map_lies_where_it_is_its_top_row_first(
    columns: dict[str, list[Any]], drive: Drive
) -> None:
    last = drive.stages[-1]
    assert len(columns["/map/grid GridMap:data"]) == len(drive.stages)
    data = np.array(columns["/map/grid GridMap:data"][-1][0], np.uint8).view(np.int8)
    shown = data.reshape(last.spec.shape)[::-1]
    assert ((shown == -1) == ~last.grid.observed).all()
    seen = last.grid.observed
    assert (shown[seen] == np.rint(100 * last.grid.occupied[seen])).all()
    assert columns["/map/grid GridMap:cell_size"][-1] == pytest.approx([last.spec.resolution])
    assert columns["/map/grid GridMap:translation"][-1][0][:2] == pytest.approx(last.spec.origin)
    layer = np.array(columns["/map/layers/count GridMap:data"][0][0], np.uint8)
    assert layer.reshape(last.spec.shape)[-1, 0] == 0
    assert layer.reshape(last.spec.shape)[0, -1] == 255


def test_ellipses_and_paths(columns: dict[str, list[Any]], drive: Drive) -> None:
    halves = np.array(columns["/map/covariance Ellipsoids3D:half_sizes"][-1:]).reshape(-1, 3)
    area = np.prod(halves[-1, :2])
    told = drive.estimates[-1].covariance[:2, :2]
    assert area == pytest.approx(5.9915 * np.sqrt(np.linalg.det(told)), rel=1e-3)
    paths = columns["/map/path LineStrips3D:strips"]
    assert [len(row[0]) for row in paths] == [len(stage.poses) for stage in drive.stages]


def test_a_picture_in_colours_is_taken_as_it_is(tmp_path: Path, drive: Drive) -> None:
    pytest.importorskip("rerun")
    spec = drive.stages[-1].spec
    cells = np.zeros((*spec.shape, 3), np.uint8)
    write_rrd(tmp_path / "a.rrd", *drive, layers={"coloured": Picture(spec, cells)})
    assert (tmp_path / "a.rrd").stat().st_size > 1000


def test_without_rerun_the_extra_is_named(
    tmp_path: Path, drive: Drive, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(rerun_file, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"dynslam\[viz\]"):
        write_rrd(tmp_path / "a.rrd", *drive)
    assert not (tmp_path / "a.rrd").exists()


def test_where_there_is_nothing_or_no_place_to_write(tmp_path: Path, drive: Drive) -> None:
    pytest.importorskip("rerun")
    with pytest.raises(InputError, match="nothing to write"):
        write_rrd(tmp_path / "a.rrd", drive.episode, [], [])
    with pytest.raises(InputError, match="cannot be written"):
        write_rrd(tmp_path / "nowhere" / "a.rrd", *drive)
