"""Files that are damaged, of another kind, or made to harm: one clear line, soon, in little memory.

Longer fuzzing, led by coverage, is in tests/fuzz.
"""

import bz2
import gzip
import io
import os
import random
import resource
import sqlite3
import struct
import subprocess
import sys
import tracemalloc
import zipfile
from pathlib import Path

import lz4.frame
import numpy as np
import pytest
from backports import zstd
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from slam.errors import InputError
from slam.io import files
from slam.io.bags import read_bag
from slam.io.bags.decompression import MAX_CHUNK, decompress_bz2, decompress_lz4, decompress_zstd
from slam.io.episode_file import load_episode
from slam.io.formats import read_log
from slam.io.loaded_recording import LoadedRecording, SourceSelection
from slam.io.warnings import WarningCounter
from slam.preprocessing.deskewing import deskewed
from tests.fuzz.mutate import damaged
from tests.slam.io.samples import reader_of, samples

NAMES = tuple(samples())


def outcome(path: Path) -> str | None:
    """None where it was read; or the one line that says why not."""
    try:
        result = reader_of(path.name)(path)
    except InputError as error:
        text = str(error)
        assert "\n" not in text
        assert len(text.replace(str(path.parent), "")) < 400
        assert str(path.parent) in text
        return text
    if isinstance(result, LoadedRecording):
        deskewed(result.episode).displacements()
        assert all(str(warned).isprintable() for warned in result.warnings)
    return None


def several_times_damaged(data: bytes, seed: int) -> bytes:
    """`data` with one to eight changes."""
    chance = random.Random(seed)
    for _ in range(chance.choice([1, 1, 2, 8])):
        data = damaged(data, chance)
    return data


@pytest.mark.parametrize("name", NAMES)
@settings(
    max_examples=25, phases=[Phase.generate],
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)  # fmt: skip
@given(seed=st.integers(0, 2**32))
def test_a_damaged_file_is_read_or_refused(tmp_path: Path, name: str, seed: int) -> None:
    (tmp_path / "map.yaml").write_bytes(samples()["map.yaml"])
    (tmp_path / "map.pgm").write_bytes(samples()["map.pgm"])
    (tmp_path / name).write_bytes(several_times_damaged(samples()[name], seed))
    outcome(tmp_path / name)


@pytest.mark.parametrize("name", NAMES)
def test_the_samples_themselves_are_read(tmp_path: Path, name: str) -> None:
    for other, data in samples().items():
        (tmp_path / other).write_bytes(data)
    assert outcome(tmp_path / name) is None


MAGICS = [
    b"", b"\0", b"#ROSBAG V2.0\n", b"#ROSBAG V1.2\n", b"\x89MCAP0\r\n", b"SQLite format 3\0",
    b"PK\x03\x04", b"PK\x05\x06" + bytes(18), b"\x1f\x8b\x08", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR",
    b"time,", b"P5\n", b"\x93NUMPY\x01\x00", b"%PDF-1.7\n", b"\xff\xfet\0i\0m\0e\0",
]  # fmt: skip


@pytest.mark.parametrize("magic", MAGICS)
@pytest.mark.parametrize("length", [0, 100, 5000])
def test_what_only_begins_like_a_recording(tmp_path: Path, magic: bytes, length: int) -> None:
    path = tmp_path / "some.log"
    path.write_bytes(magic + random.Random(length).randbytes(length))
    assert outcome(path)


@pytest.mark.parametrize("name", NAMES[:-1])
def test_a_pipe_a_device_and_a_folder_are_no_files(tmp_path: Path, name: str) -> None:
    """Not waited for, and not read until memory is full."""
    path = tmp_path / name
    os.mkfifo(path)
    assert "a file was expected, this is a device or a pipe" in (outcome(path) or "")
    path.unlink()
    path.symlink_to("/dev/zero")
    assert "a file was expected, this is a device or a pipe" in (outcome(path) or "")
    path.unlink()
    path.mkdir()
    assert outcome(path)
    path.rmdir()
    assert "no such file" in (outcome(path) or "")


def test_a_pipe_in_the_folder_of_a_bag(tmp_path: Path) -> None:
    (tmp_path / "metadata.yaml").write_text("rosbag2_bagfile_information: {}")
    os.mkfifo(tmp_path / "drive_0.mcap")
    with pytest.raises(InputError, match=r"drive_0\.mcap in it is no file"):
        read_log(tmp_path)


def test_metadata_that_repeats_itself(tmp_path: Path) -> None:
    """A billion of the same in a few lines of YAML."""
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 9)}]" for k in range(1, 12)]
    (tmp_path / "metadata.yaml").write_text(
        "\n".join(lines) + "\nrosbag2_bagfile_information: {version: *a11}\n"
    )
    with pytest.raises(InputError, match=r"its metadata\.yaml repeats itself"):
        read_log(tmp_path)


def test_no_pickle_is_ever_loaded(tmp_path: Path) -> None:
    class Harm:
        def __reduce__(self):
            return (Path.touch, (tmp_path / "harmed",))

    harm = np.array([Harm()], dtype=object)
    for names in ({"times": harm, "ranges": harm, "angles": harm}, {"format": harm}):
        path = tmp_path / "harm.npz"
        np.savez(path, allow_pickle=True, **names)
        assert "allow_pickle=False" in (outcome(path) or "")
    assert not (tmp_path / "harmed").exists()


@pytest.mark.parametrize(
    ("array", "message"),
    [
        ({"ranges": np.array([["a", "b"]])}, "an array of numbers"),
        ({"ranges": np.ones((1, 2), complex)}, "an array of numbers"),
        ({"ranges": np.ones((2, 2))}, "for 1 times and 2 angles"),
        ({"ranges": np.ones((1, 0)), "angles": np.ones(0)}, "0 angles"),
        ({"times": np.array([np.nan])}, "finite time"),
        ({"mount": np.zeros(2)}, "not enough values"),
        ({"mount": np.array([0, np.nan, 0])}, "finite mount"),
        ({"range_max": np.inf}, "range_max must be finite"),
        ({"range_max": np.ones(3)}, "an array of numbers with 0 dimensions"),
        ({"odometry_poses": np.zeros((1, 3))}, "odometry_poses without odometry_times"),
        ({"poses": np.zeros((1, 2))}, r"poses \(n, 3\)"),
    ],
)
def test_arrays_that_are_no_scans(tmp_path: Path, array: dict, message: str) -> None:
    good = {"times": np.array([1.0]), "ranges": np.ones((1, 2)), "angles": np.array([0.0, 0.1])}
    np.savez(tmp_path / "some.npz", **{**good, **array})
    with pytest.raises(InputError, match=f"some.npz: .*{message}.*; expected times"):
        read_log(tmp_path / "some.npz")


@pytest.mark.parametrize(
    ("array", "message"),
    [
        ({"ranges": np.full(12, "x")}, "an array of numbers"),
        ({"meta": "[]"}, "meta must be an object"),
        ({"beams": np.array([0, 4, 8])}, "one beam at least"),
        ({"truth_poses": np.zeros((3, 2))}, "the truth has poses"),
        ({"odometry_times": np.zeros(0), "odometry_poses": np.zeros((0, 3))}, "one pose at least"),
        ({"limits": np.full((3, 3), np.inf)}, "finite time"),
        ({"format": "dynslam\nepisode"}, "format dynslam episode, expected"),
    ],
)
def test_an_episode_that_cannot_be_one(tmp_path: Path, array: dict, message: str) -> None:
    with np.load(io.BytesIO(samples()["episode.npz"])) as stored:
        data = {name: stored[name] for name in stored.files}
    np.savez(tmp_path / "some.npz", **{**data, **array})
    with pytest.raises(InputError, match=f"some.npz: not an episode .*{message}"):
        load_episode(tmp_path / "some.npz")


def test_only_a_bag_has_things_to_choose_from(tmp_path: Path) -> None:
    path = tmp_path / "some.csv"
    path.write_bytes(samples()["table.csv"])
    with pytest.raises(InputError, match=r"some\.csv: only a ROS bag has several"):
        read_log(path, SourceSelection("/scan"))
    assert not read_log(path, SourceSelection(odometry="none")).episode.has_odometry


@pytest.mark.parametrize("unpack", [decompress_bz2, decompress_lz4, decompress_zstd])
def test_a_chunk_that_ends_early_is_damaged(unpack) -> None:
    pack = {
        decompress_bz2: bz2.compress,
        decompress_lz4: lz4.frame.compress,
        decompress_zstd: zstd.compress,
    }
    packed = pack[unpack](random.Random(0).randbytes(1000))
    assert unpack(packed) == random.Random(0).randbytes(1000)
    with pytest.raises(EOFError, match="ends early"):
        unpack(packed[:-20])


def test_names_in_a_bag_are_shown_on_one_line(tmp_path: Path) -> None:
    raw = (
        samples()["ros1.bag"]
        .replace(b"topic=/scan", b"topic=/s\n\x1bn")
        .replace(b"/odom", b"/od\nm")
    )
    path = tmp_path / "some.bag"
    path.write_bytes(raw.replace(b"sensor_msgs/LaserScan", b"sensor_msgs/LaserScon"))
    assert "no sensor_msgs/msg/LaserScan in it; topics: " in (outcome(path) or "")


def test_warnings_of_many_kinds_are_counted_together() -> None:
    warnings = WarningCounter()
    for k in range(10_000):
        warnings.add(f"frame {k}\n", k)
    found = warnings.counted()
    assert len(found) == 51
    assert str(found[-1]) == "other trouble: 9950 times, first on line 50"


def npy(shape: str, data: bytes = b"") -> bytes:
    head = f"{{'descr': '<f8', 'fortran_order': False, 'shape': {shape}, }}".encode()
    head += b" " * (117 - len(head)) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(head)) + head + data


def zipped(**arrays: bytes) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as packed:
        for name, data in arrays.items():
            packed.writestr(f"{name}.npy", data)
    return file.getvalue()


def bag_of_one_chunk(packing: bytes, data: bytes, size: int) -> bytes:
    """A ROS 1 bag without index whose only chunk is `data`."""

    def record(head: dict[bytes, bytes], body: bytes, announced: int | None = None) -> bytes:
        fields = b"".join(
            struct.pack("<I", len(name) + 1 + len(value)) + name + b"=" + value
            for name, value in head.items()
        )
        length = len(body) if announced is None else announced
        return struct.pack("<I", len(fields)) + fields + struct.pack("<I", length) + body

    opening = {
        b"op": b"\x03",
        b"index_pos": bytes(8),
        b"conn_count": bytes(4),
        b"chunk_count": bytes(4),
    }
    chunk = {b"op": b"\x05", b"compression": packing, b"size": struct.pack("<I", len(data))}
    return b"#ROSBAG V2.0\n" + record(opening, b" ") + record(chunk, data, size)


def mcap(*records: tuple[int, bytes, int | None]) -> bytes:
    out = b"\x89MCAP0\r\n"
    for kind, body, announced in ((1, struct.pack("<I4sI", 4, b"ros2", 0), None), *records):
        out += struct.pack("<BQ", kind, len(body) if announced is None else announced) + body
    return out + b"\x02" + struct.pack("<QQQI", 20, 0, 0, 0) + b"\x89MCAP0\r\n"


def mcap_chunk(packing: bytes, data: bytes, size: int) -> tuple[int, bytes, None]:
    head = struct.pack("<QQQI", 0, 1, size, 0) + struct.pack("<I", len(packing)) + packing
    return 6, head + struct.pack("<Q", len(data)) + data, None


def sqlite_bomb(path: Path) -> None:
    """Messages of 100 MB each that take no room: made up when asked for."""
    with sqlite3.connect(path) as made:
        made.executescript(
            "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT, type TEXT, "
            "serialization_format TEXT, offered_qos_profiles TEXT);"
            "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, "
            "data BLOB GENERATED ALWAYS AS (zeroblob(100000000)) VIRTUAL);"
            "INSERT INTO topics VALUES(1, '/scan', 'sensor_msgs/msg/LaserScan', 'cdr', '');"
            "WITH RECURSIVE n(k) AS (SELECT 1 UNION ALL SELECT k + 1 FROM n WHERE k < 1000) "
            "INSERT INTO messages(topic_id, timestamp) SELECT 1, k FROM n;"
        )


def bombs(folder: Path) -> None:
    """Files that announce, or unpack to, far more than they hold."""
    ones = np.ones(3).tobytes()
    many = zipped(times=npy("(1000000000000,)", ones), ranges=npy("(1, 3)", ones), angles=ones)
    nothing = bytes(140 << 20)
    contents = {
        "zeros.log.gz": gzip.compress(nothing[: 80 << 20], 1),
        "commas.csv.gz": gzip.compress(
            b"# angle_min: 0\n# angle_increment: 1\n" + b"time," * 16_000_000, 1
        ),
        "line.log": b"FLASER 180 " + b"1 " * (50 << 20),
        "announced.npz": many,
        "zeros.npz": zipped(times=npy("(18350080,)", nothing), ranges=nothing, angles=nothing),
        "chunk.bag": bag_of_one_chunk(b"none", b"", 2**32 - 1),
        "bz2.bag": bag_of_one_chunk(b"bz2", packed := bz2.compress(nothing), len(packed)),
        "lz4.bag": bag_of_one_chunk(b"lz4", packed := lz4.frame.compress(nothing), len(packed)),
        "record.mcap": mcap((6, b"", 2**63)),
        "longest.mcap": mcap((5, b"", 2**64 - 1)),
        "zstd.mcap": mcap(mcap_chunk(b"zstd", zstd.compress(nothing), 140 << 20)),
        "lz4.mcap": mcap(mcap_chunk(b"lz4", lz4.frame.compress(nothing), 140 << 20)),
    }
    for name, data in contents.items():
        (folder / name).write_bytes(data)
    sqlite_bomb(folder / "blobs.db3")


SCRIPT = """
import resource, sys
from slam.errors import InputError
import slam.io.bags
from slam.io.formats import read_log
resource.setrlimit(resource.RLIMIT_AS, ({limit}, {limit}))
resource.setrlimit(resource.RLIMIT_CPU, (60, 60))
for path in sys.argv[1:]:
    try:
        read_log(path)
        print(path, "was read")
    except InputError as error:
        print(error)
"""


def test_bombs_are_refused_in_bounded_memory(tmp_path: Path) -> None:
    """3 GB of addresses, of which the libraries themselves take one or two."""
    bombs(tmp_path)
    paths = sorted(map(str, tmp_path.iterdir()))
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT.format(limit=3 << 30), *paths],
        capture_output=True, text=True, timeout=120, check=False,
        cwd=Path(__file__).parents[3],
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-2000:]
    lines = done.stdout.splitlines()
    assert len(lines) == len(paths), lines
    for path, line in zip(paths, lines, strict=True):
        assert line.startswith(f"{path}:"), line
        assert len(line) < 400 + len(path)
    assert resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss < 3 << 20  # kB


LONG_NAMES = {
    "of a default": f"TEXT DEFAULT '{'x' * 900_000}'",
    "made up": "TEXT GENERATED ALWAYS AS (hex(zeroblob(450000))) VIRTUAL",
    "made up, behind a NUL": "TEXT GENERATED ALWAYS AS (char(0) || hex(zeroblob(450000))) VIRTUAL",
}


@pytest.mark.parametrize("names", LONG_NAMES)
def test_names_of_topics_that_take_no_room_in_the_file(tmp_path: Path, names: str) -> None:
    """41 kB took 3.6 GB."""
    path = tmp_path / "some.db3"
    with sqlite3.connect(path) as made:
        made.executescript(
            "CREATE TABLE topics(id INTEGER PRIMARY KEY, type TEXT, serialization_format TEXT, "
            "offered_qos_profiles TEXT);"
            "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, "
            "data BLOB);"
            "WITH RECURSIVE n(k) AS (SELECT 1 UNION ALL SELECT k + 1 FROM n WHERE k < 100) "
            "INSERT INTO topics SELECT k, 'sensor_msgs/msg/LaserScan', 'cdr', '' FROM n;"
            f"ALTER TABLE topics ADD COLUMN name {LONG_NAMES[names]};"
        )
    tracemalloc.start()
    with pytest.raises(InputError, match="its messages are larger than the file"):
        read_log(path)
    assert tracemalloc.get_traced_memory()[1] < 10e6
    tracemalloc.stop()


def test_scans_that_announce_a_billion_ranges(tmp_path: Path) -> None:
    raw = samples()["ros1.bag"]
    ranges = struct.pack("<I", 4) + np.array([1.5, 2.25], np.float32).tobytes()
    assert raw.count(ranges) == 3
    path = tmp_path / "some.bag"
    path.write_bytes(raw.replace(ranges, struct.pack("<I", 10**9) + ranges[4:]))
    assert "no usable scan on /scan" in (outcome(path) or "")
    path.write_bytes(raw.replace(ranges, struct.pack("<I", 10**9) + ranges[4:], 1))
    log = read_bag(path)
    assert len(log.episode.scans) == 2
    assert "/scan: no sensor_msgs/msg/LaserScan, left out: once" in str(log.warnings[0])


def test_a_text_of_one_endless_line_is_given_up(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setattr(files, "MAX_TEXT_LINE", 1 << 21)
    path = tmp_path / "some.log"
    path.write_bytes(b"x" * (4 << 20))
    with pytest.raises(InputError, match=r"some\.log:1: a line of over 2 MB, as no log has"):
        read_log(path)


def test_the_bound_on_a_chunk_is_larger_than_any_that_is_written() -> None:
    assert MAX_CHUNK >= 100 << 20
