# pyright: reportMissingImports=false
from pathlib import Path

import numpy as np
import pytest
from dynslam_cli.figures.map_film import ECHOES, write_map_film
from dynslam_cli.figures.style import ESTIMATE, LOST, UNKNOWN
from PIL import Image, ImageColor, ImageSequence

import slam
from slam.benchmark.run import Playback
from slam.benchmark.snapshots import SnapshotRecorder
from slam.episode import Episode
from slam.errors import InputError
from slam.maps.snapshot import MapSnapshot

SCANS = 80  # of the drive
NEVER_LOST = np.zeros(SCANS)


@pytest.fixture(scope="module")
def stages(short_episode: Episode) -> list[MapSnapshot]:
    playback = Playback(slam.make("dynamic-ml"), short_episode)
    growth = SnapshotRecorder(playback, stages=5)
    for number, _ in enumerate(playback):
        growth.after(number)
    return growth.stages()


def frames_of(path: Path) -> list[np.ndarray]:
    with Image.open(path) as image:
        return [np.asarray(one.convert("RGB")) for one in ImageSequence.Iterator(image)]


def pixels(frame: np.ndarray, colour: str) -> int:
    return int((frame[30:] == ImageColor.getrgb(colour)).all(axis=2).sum())


def test_the_map_grows_around_a_robot_and_its_echoes(
    tmp_path: Path, short_episode: Episode, stages: list[MapSnapshot]
) -> None:
    write_map_film(tmp_path / "a.gif", short_episode, stages, "a drive", NEVER_LOST, width=400)
    frames = frames_of(tmp_path / "a.gif")
    assert len(frames) == len(stages)
    assert {frame.shape[1] for frame in frames} == {400}
    unknown = [pixels(frame, UNKNOWN) for frame in frames]
    assert unknown[0] > unknown[-1] > 0
    for frame in frames:
        assert pixels(frame, ESTIMATE) > 50
        assert pixels(frame, ECHOES) > 20
        assert pixels(frame, LOST) == 0


def test_a_lost_robot_its_path_and_the_probability_are_in_another_colour(
    tmp_path: Path, short_episode: Episode, stages: list[MapSnapshot]
) -> None:
    lost = np.zeros(SCANS)
    lost[stages[1].scan - 5 : stages[2].scan + 1] = 0.97
    write_map_film(tmp_path / "a.gif", short_episode, stages, "a drive", lost, width=400)
    frames = frames_of(tmp_path / "a.gif")
    found = [pixels(frame, LOST) for frame in frames]
    assert found[0] == 0
    assert min(found[1:3]) > 1000  # the label, robot and path
    assert all(20 < count < 1000 for count in found[3:])  # only the path


def test_nothing_of_a_robot_that_is_always_lost_is_in_the_usual_colour(
    tmp_path: Path, short_episode: Episode, stages: list[MapSnapshot]
) -> None:
    lost = np.full(SCANS, 0.97)
    write_map_film(tmp_path / "a.gif", short_episode, stages, "a drive", lost, width=400)
    assert {pixels(frame, ESTIMATE) for frame in frames_of(tmp_path / "a.gif")} == {0}


def test_the_same_run_is_the_same_film(
    tmp_path: Path, short_episode: Episode, stages: list[MapSnapshot]
) -> None:
    for name in ("a.gif", "b.gif"):
        write_map_film(tmp_path / name, short_episode, stages, "a drive", NEVER_LOST, width=300)
    assert (tmp_path / "a.gif").read_bytes() == (tmp_path / "b.gif").read_bytes()


def test_a_run_without_a_scan_is_no_film(tmp_path: Path, short_episode: Episode) -> None:
    with pytest.raises(InputError, match="without a scan"):
        write_map_film(tmp_path / "a.gif", short_episode, [], "nothing", NEVER_LOST)
