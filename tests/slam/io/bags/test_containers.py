"""The same drive out of every kind of file that ROS writes."""

import struct
from pathlib import Path

import numpy as np
import pytest
from backports import zstd
from rosbags import rosbag1

from slam.errors import InputError
from slam.io.bags import read_bag
from slam.io.bags.bag import ROS1, ROS2
from slam.io.bags.bag_writer import BagWriter
from slam.io.formats import kind_of, read_log
from slam.io.loaded_recording import LoadedRecording
from tests.slam.io.bags.recordings import drive, scan, told, write, write_packed

KINDS = ["some.bag", "some.mcap", "some.db3", "folder"]
PACKINGS = [
    ("some.bag", "bz2"), ("some.bag", "lz4"), ("folder", "mcap storage"),
    ("folder", "mcap message"), ("folder", "mcap file"), ("folder", "sqlite3 message"),
    ("folder", "sqlite3 file"),
]  # fmt: skip


def check(log: LoadedRecording, scans: int = 5) -> None:
    assert len(log.episode.scans) == scans
    for k, one in enumerate(log.episode.scans):
        assert one.time == pytest.approx(1.05 + 0.2 * k)
        assert one.ranges.tolist() == [1, 2, 3]
        assert one.mount == pytest.approx((0.3, 0, 0))
    np.testing.assert_allclose(log.episode.odometry.at(np.array([1.25]))[0, 0], 0.25, atol=1e-9)


@pytest.mark.parametrize("name", KINDS)
def test_every_container(tmp_path: Path, name: str) -> None:
    path = write(tmp_path / name, drive())
    assert kind_of(path) == "bag"
    log = read_log(path)
    check(log)
    assert log.warnings == ()
    assert log.episode.meta["source"] == name


@pytest.mark.parametrize(("name", "packing"), PACKINGS)
def test_every_packing(tmp_path: Path, name: str, packing: str) -> None:
    log = read_log(write_packed(tmp_path / name, drive(), packing))
    check(log)
    assert log.warnings == ()


@pytest.mark.parametrize("name", KINDS[:3])
def test_a_file_of_any_name(tmp_path: Path, name: str) -> None:
    odd = tmp_path / "100% of #3?.active"
    write(tmp_path / name, drive()).rename(odd)
    check(read_log(odd))


def test_messages_in_the_other_byte_order(tmp_path: Path) -> None:
    """CDR may be big-endian: the second byte of each message says so."""
    from rosbags import rosbag2
    from rosbags.rosbag2 import StoragePlugin

    path = tmp_path / "big"
    with rosbag2.Writer(path, version=8, storage_plugin=StoragePlugin.MCAP) as writer:
        out, connections = BagWriter(writer), {}
        for topic, received, build in drive():
            message = build(out)
            kind = message.__msgtype__
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=ROS2)
            data = ROS2.serialize_cdr(message, kind, little_endian=False)
            writer.write(connections[topic], round(received * 1e9), data)
    check(read_bag(path))


def test_transforms_of_the_oldest_recordings(tmp_path: Path) -> None:
    """tf/tfMessage, before tf2."""
    path = tmp_path / "old.bag"
    with rosbag1.Writer(path) as writer:
        out, connections = BagWriter(writer), {}
        for topic, received, build in drive():
            message = build(out)
            kind = message.__msgtype__
            old = kind.replace("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage")
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, old, typestore=ROS1)
            data = bytes(ROS1.serialize_ros1(message, kind))
            writer.write(connections[topic], round(received * 1e9), data)
    check(read_bag(path))


def test_two_programs_on_one_topic(tmp_path: Path) -> None:
    """rosbag keeps a connection for each."""
    path = tmp_path / "two.bag"
    with rosbag1.Writer(path) as writer:
        out, connections = BagWriter(writer), {}
        for number, (topic, received, build) in enumerate(drive()):
            message = build(out)
            who = f"/program{number % 2}"
            if (topic, who) not in connections:
                connections[topic, who] = writer.add_connection(
                    topic, message.__msgtype__, typestore=ROS1, callerid=who
                )
            data = bytes(ROS1.serialize_ros1(message, message.__msgtype__))
            writer.write(connections[topic, who], round(received * 1e9), data)
    check(read_bag(path))


def test_a_folder_without_a_recording_is_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no metadata\.yaml in it, as a ROS 2 bag has"):
        read_log(tmp_path)


@pytest.mark.parametrize("ending", [".mcap", ".db3"])
def test_a_folder_whose_recorder_was_killed(tmp_path: Path, ending: str) -> None:
    """metadata.yaml is written last."""
    folder = tmp_path / "drive"
    folder.mkdir()
    write(folder / f"drive_0{ending}", drive())
    check(read_log(folder))


@pytest.mark.parametrize("packing", ["none", "lz4", "bz2"])
@pytest.mark.parametrize("cut", ["index", "half"])
def test_a_ros1_bag_that_was_cut_off(tmp_path: Path, packing: str, cut: str) -> None:
    """Without its index, and in the midst of a chunk."""
    whole = tmp_path / "whole.bag"
    if packing == "none":
        write(whole, drive(60))
    else:
        write_packed(whole, drive(60), packing)
    raw = bytearray(whole.read_bytes())
    (index,) = struct.unpack_from("<Q", raw, raw.index(b"index_pos=") + len("index_pos="))
    start = raw.index(b"op=\x05")  # of the only chunk
    kept = raw[:index] if cut == "index" else raw[: start + (index - start) // 2]
    whole.write_bytes(kept)
    if cut == "half" and packing != "none":
        with pytest.raises(InputError, match="`rosbag reindex` may mend it"):
            read_log(whole)
        return
    log = read_log(whole)
    count = len(log.episode.scans)
    assert count == 60 if cut == "index" else 10 < count < 50
    check(log, count)
    assert "recording cut off, the part before used" in told(log)


def test_a_ros1_bag_whose_recorder_crashed(tmp_path: Path) -> None:
    """rosbag writes a chunk's size when it is whole: the last one says 0, and so does the index."""
    path = write(tmp_path / "crashed.bag", drive(60))
    raw = bytearray(path.read_bytes())
    at = raw.index(b"index_pos=") + len("index_pos=")
    (index,) = struct.unpack_from("<Q", raw, at)
    raw[at : at + 8] = bytes(8)
    chunk = raw.index(b"compression=none")
    size = raw.index(b"size=", chunk) + len("size=")
    raw[size : size + 8] = bytes(8)
    path.write_bytes(raw[: index - 999])
    log = read_log(path)
    assert len(log.episode.scans) > 50
    assert "recording cut off" in told(log)


@pytest.mark.parametrize("kept", [0.1, 0.5, 0.99])
def test_an_mcap_that_was_cut_off(tmp_path: Path, kept: float) -> None:
    """Whole chunks count; of 1 MB each, as they are written here."""
    rng = np.random.default_rng(0)  # of which little can be packed away
    said = [scan(1 + 0.1 * k, rng.uniform(1, 5, 4000), (0.0, 1e-3)) for k in range(200)]
    path = write(tmp_path / "cut.mcap", said)
    raw = path.read_bytes()
    path.write_bytes(raw[: int(kept * len(raw))])
    if kept == 0.1:
        with pytest.raises(InputError, match=r"cut\.mcap: .*`mcap recover` may mend it"):
            read_log(path)
        return
    log = read_log(path)
    assert "recording cut off, the part before used" in told(log)
    np.testing.assert_allclose(log.episode.times, 1 + 0.1 * np.arange(len(log.episode.scans)))
    assert kept * 200 - 70 <= len(log.episode.scans) <= kept * 200


def test_an_mcap_without_chunks_in_any_order(tmp_path: Path) -> None:
    """As `ros2 bag record --storage-preset-profile fastwrite` writes it."""
    path = write(tmp_path / "some.mcap", drive())
    path.write_bytes(unchunked(path.read_bytes()))
    check(read_log(path))


def unchunked(raw: bytes) -> bytes:
    """The records of the chunks one after the other, and an empty footer."""
    out, at = raw[:8], 8
    while at < len(raw) - 8:
        kind, size = struct.unpack_from("<BQ", raw, at)
        body = raw[at + 9 : at + 9 + size]
        if kind == 0x01:
            out += raw[at : at + 9 + size]
        elif kind == 0x06:
            (name,) = struct.unpack_from("<I", body, 28)
            assert body[32 : 32 + name] == b"zstd"
            out += zstd.decompress(body[28 + 4 + name + 8 :])
        at += 9 + size
    return out + b"\x02" + struct.pack("<QQQI", 20, 0, 0, 0) + raw[:8]
