# pyright: reportMissingImports=false
from pathlib import Path

import numpy as np
import pytest
from dynslam_cli.figures.map_film import ECHOES, write_map_film
from dynslam_cli.figures.style import ESTIMATE, UNKNOWN
from PIL import Image, ImageColor, ImageSequence

import slam
from slam.benchmark.run import Playback
from slam.benchmark.snapshots import SnapshotRecorder
from slam.episode import Episode
from slam.errors import InputError
from slam.maps.snapshot import MapSnapshot


@pytest.fixture(scope="module")
def stages(short_episode: Episode) -> list[MapSnapshot]:
    playback = Playback(slam.make("dynamic-ml"), short_episode)
    growth = SnapshotRecorder(playback, stages=5)
    for number, _ in enumerate(playback):
        growth.after(number)
    return growth.stages()


def pixels(frame: np.ndarray, colour: str) -> int:
    return int((frame[30:] == ImageColor.getrgb(colour)).all(axis=2).sum())


def test_the_map_grows_around_a_robot_and_its_echoes(
    tmp_path: Path, short_episode: Episode, stages: list[MapSnapshot]
) -> None:
    write_map_film(tmp_path / "a.gif", short_episode, stages, "a drive", width=400)
    with Image.open(tmp_path / "a.gif") as image:
        frames = [np.asarray(one.convert("RGB")) for one in ImageSequence.Iterator(image)]
    assert len(frames) == len(stages)
    assert {frame.shape[1] for frame in frames} == {400}
    unknown = [pixels(frame, UNKNOWN) for frame in frames]
    assert unknown[0] > unknown[-1] > 0
    for frame in frames:
        assert pixels(frame, ESTIMATE) > 50
        assert pixels(frame, ECHOES) > 20


def test_the_same_run_is_the_same_film(
    tmp_path: Path, short_episode: Episode, stages: list[MapSnapshot]
) -> None:
    for name in ("a.gif", "b.gif"):
        write_map_film(tmp_path / name, short_episode, stages, "a drive", width=300)
    assert (tmp_path / "a.gif").read_bytes() == (tmp_path / "b.gif").read_bytes()


def test_a_run_without_a_scan_is_no_film(tmp_path: Path, short_episode: Episode) -> None:
    with pytest.raises(InputError, match="without a scan"):
        write_map_film(tmp_path / "a.gif", short_episode, [], "nothing")
