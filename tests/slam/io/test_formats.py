"""A file format of one's own: one function that recognises it, one that reads it."""

from pathlib import Path

import numpy as np
import pytest

import slam
from slam.errors import InputError
from slam.geometry import Pose2
from slam.io import formats
from slam.io.formats import kind_of
from slam.io.loaded_recording import LoadedRecording, SourceSelection
from slam.io.warnings import RecordingWarning
from tests.slam.worlds import drive

MARK = b"OWN FORMAT"


@pytest.fixture
def own(tmp_path, monkeypatch) -> Path:
    """A file of a format of one's own; what a test registers is gone after it."""
    monkeypatch.setattr(formats, "_READERS", dict(formats._READERS))
    path = tmp_path / "drive.log"
    path.write_bytes(MARK + b" 3 scans\n")
    return path


def recognises(path: Path, head: bytes) -> bool:
    return head.startswith(MARK)


def test_is_read_by_its_function(own: Path) -> None:
    with pytest.raises(InputError):  # before it is known: no CARMEN log
        slam.read_log(own)
    episode, seen = drive(3), []
    slam.register_reader("own", recognises, lambda path: seen.append(path) or episode)
    assert kind_of(own) == "own"
    assert slam.read_log(str(own)) == LoadedRecording(episode, ())
    assert seen == [own]


def test_may_warn_and_lies_under_a_choice_of_the_mount(own: Path) -> None:
    warnings = (RecordingWarning("odd line", 2, 7),)
    slam.register_reader("own", recognises, lambda path: LoadedRecording(drive(3), warnings))
    log = slam.read_log(own, SourceSelection(mount=Pose2(1.0, 2.0, 3.0), odometry="none"))
    assert log.warnings == warnings
    assert {scan.mount for scan in log.episode.scans} == {Pose2(1.0, 2.0, 3.0)}
    assert not log.episode.has_odometry
    with pytest.raises(InputError, match="only a ROS bag has several lasers"):
        slam.read_log(own, SourceSelection(laser="/front"))


def test_others_are_read_as_before(own: Path, tmp_path: Path) -> None:
    slam.register_reader("own", recognises, lambda path: drive(3))
    episode = drive(4)
    for ending, kind in ((".npz", "episode"), (".csv", "csv"), (".log.gz", "carmen")):
        path = tmp_path / f"written{ending}"
        slam.write_log(episode, path)
        assert kind_of(path) == kind
        times = slam.read_log(path).episode.times
        np.testing.assert_allclose(times, episode.times, atol=1e-6)


def test_a_folder_can_be_recognised_too(own: Path) -> None:
    assert kind_of(own.parent) == "bag"
    slam.register_reader(
        "own", lambda path, head: path.is_dir() and not head, lambda path: drive(3)
    )
    assert kind_of(own.parent) == "own"


def test_a_wrong_reader_is_refused_with_what_is_wrong(own: Path) -> None:
    with pytest.raises(InputError, match="'csv' is one of dynslam's own formats"):
        slam.register_reader("csv", recognises, lambda path: drive(3))
    with pytest.raises(InputError, match="read of 'own' must be a function or a class, got None"):
        slam.register_reader("own", recognises, None)  # pyright: ignore
    slam.register_reader("own", recognises, lambda path: 3)  # pyright: ignore
    with pytest.raises(InputError, match=r"the reader 'own' returns must be an Episode .* got 3"):
        slam.read_log(own)
