"""The rawlog for MRPT, read again by the layout of its objects."""

import gzip
import importlib.util
import struct
import sys

import numpy as np
import pytest
from dynslam_cli.outside.adapter import READY  # pyright: ignore[reportMissingImports]

from agents import record_corridor
from slam.geometry import Pose2
from slam.io.csv_log import write_csv


@pytest.fixture
def module(monkeypatch):
    monkeypatch.syspath_prepend(str(READY))
    spec = importlib.util.spec_from_file_location("write_rawlog", READY / "write_rawlog.py")
    assert spec is not None
    assert spec.loader is not None
    found = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(found)
    yield found
    sys.modules.pop("scan_table", None)


def after(data: bytes, name: bytes, at: int = 0) -> int:
    """The position behind the name and the version of the next object of a kind."""
    return data.index(bytes([0x80 | len(name)]) + name, at) + len(name) + 2


def test_it_holds_every_displacement_and_every_range(module, tmp_path):
    episode = record_corridor(3, "moving")
    write_csv(episode, tmp_path / "drive.csv")
    module.main(str(tmp_path / "drive.csv"), str(tmp_path / "drive.rawlog"))
    data = gzip.decompress((tmp_path / "drive.rawlog").read_bytes())
    assert data.count(b"CActionCollection") == data.count(b"CSensoryFrame") == len(episode.scans)
    at, pose = 0, Pose2.of(episode.odometry.poses[0])
    for scan, expected in zip(episode.scans, episode.odometry.at(episode.times), strict=True):
        at = after(data, b"mrpt::poses::CPose2D", at)
        pose = pose @ Pose2(*struct.unpack_from("<3d", data, at))
        assert np.array(pose)[:2] == pytest.approx(expected[:2], abs=1e-6)
        at = after(data, b"mrpt::obs::CObservation2DRangeScan", at)
        aperture, leftwards, far = struct.unpack_from("<f?f", data, at)
        assert (aperture, leftwards, far) == (pytest.approx(np.pi), True, scan.max_range)
        at = after(data, b"mrpt::poses::CPose3D", at) + 12 * 8 + 1
        (count,) = struct.unpack_from("<I", data, at)
        ranges = np.frombuffer(data, "<f4", count, at + 4)
        seen = np.frombuffer(data, "u1", count, at + 4 + 4 * count).astype(bool)
        assert (seen == scan.hit).all()
        assert ranges[seen] == pytest.approx(scan.ranges[scan.hit], abs=1e-4)
        ticks = struct.unpack_from("<Q", data, at + 4 + 5 * count + 4)[0]
        assert ticks * 1e-7 - 11_644_473_600 - 1e9 == pytest.approx(scan.time, abs=1e-4)
